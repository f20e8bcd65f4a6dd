// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/measured_speed.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/motion_truth.hpp"
#include "stillmap/evaluate/pose_at.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

cv::Mat flow_between(const cv::Mat& from, const cv::Mat& to) {
  cv::Mat flow;
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)->calc(from, to, flow);
  return flow;
}

/// Pixels well inside the mask.
cv::Mat inside(const cv::Mat& mask, int margin) {
  cv::Mat eroded;
  const cv::Size square(2 * margin + 1, 2 * margin + 1);
  cv::erode(mask != 0, eroded, cv::getStructuringElement(cv::MORPH_RECT, square));
  return eroded;
}

/// World displacement of pixels, 32FC3 [m], and where there is one, 8UC1.
struct Displacements {
  cv::Mat3f vectors;
  cv::Mat1b known;
};

/// Where the pixel (u, v) of one picture was seen in the other; none where that cannot be said.
std::optional<Eigen::Vector3d> displacement(const PosedPicture& from, const PosedPicture& to,
                                            const Camera& camera, const cv::Mat& sound_in_to, int u,
                                            int v, const cv::Vec2f& flow) {
  const float x = static_cast<float>(u) + flow[0], y = static_cast<float>(v) + flow[1];
  if (!camera.contains(x, y, 1)) return std::nullopt;
  const cv::Point q(static_cast<int>(std::lround(x)), static_cast<int>(std::lround(y)));
  const float depth = from.image->depth.at<float>(v, u), later = to.image->depth.at<float>(q);
  if (depth <= 0 || later <= 0 || sound_in_to.at<std::uint8_t>(q) == 0) return std::nullopt;
  return to.T_world_camera * camera.unproject(x, y, later) -
         from.T_world_camera * camera.unproject(u, v, depth);
}

Displacements displacements(const PosedPicture& from, const PosedPicture& to, const Camera& camera,
                            const SpeedOptions& options, double seconds) {
  const cv::Mat flow = flow_between(from.image->gray, to.image->gray);
  const cv::Mat sound = inside(from.mask, options.outline_margin),
                sound_in_to = inside(to.mask, options.outline_margin);
  Displacements found{cv::Mat3f::zeros(flow.size()), cv::Mat1b::zeros(flow.size())};
  for (int v = 0; v < flow.rows; ++v) {
    for (int u = 0; u < flow.cols; ++u) {
      if (sound.at<std::uint8_t>(v, u) == 0) continue;
      const auto d = displacement(from, to, camera, sound_in_to, u, v, flow.at<cv::Vec2f>(v, u));
      if (!d || d->norm() > options.max_speed * seconds) continue;
      found.vectors(v, u) = {static_cast<float>(d->x()), static_cast<float>(d->y()),
                             static_cast<float>(d->z())};
      found.known(v, u) = 255;
    }
  }
  return found;
}

/// Length of the mean displacement [m] in the window around each pixel; negative where too few are
/// known.
cv::Mat1f local_lengths(const Displacements& d, const SpeedOptions& options) {
  const cv::Size window(options.window, options.window);
  cv::Mat3f sums;
  cv::Mat1f support;
  cv::blur(d.vectors, sums, window);
  cv::blur(cv::Mat1f(d.known) / 255, support, window);
  cv::Mat1f lengths(support.size(), -1);
  for (int v = 0; v < lengths.rows; ++v) {
    for (int u = 0; u < lengths.cols; ++u) {
      if (support(v, u) < options.min_support) continue;
      lengths(v, u) = static_cast<float>(cv::norm(sums(v, u)) / support(v, u));
    }
  }
  return lengths;
}

/// The length of the mean displacement of each piece of the mask; negative where there is none.
std::vector<double> piece_lengths(const Displacements& d, const cv::Mat1i& pieces, int count) {
  std::vector<cv::Vec3d> sums(static_cast<std::size_t>(count));
  std::vector<double> known(sums.size()), lengths(sums.size(), -1);
  for (int v = 0; v < pieces.rows; ++v) {
    for (int u = 0; u < pieces.cols; ++u) {
      if (d.known(v, u) == 0) continue;
      const auto piece = static_cast<std::size_t>(pieces(v, u));
      sums[piece] += cv::Vec3d(d.vectors(v, u));
      ++known[piece];
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    if (known[i] > 0) lengths[i] = cv::norm(sums[i]) / known[i];
  }
  return lengths;
}

/// A picture of the sequence, where it has a mask and a true pose.
struct Candidate {
  RgbdFramePtr image;
  std::optional<PosedPicture> picture;
};

Candidate candidate(const RgbdFramePtr& image, const StampedImages& masks,
                    const Trajectory& truth) {
  Candidate made{image, std::nullopt};
  const cv::Mat mask = masks.at(image->timestamp);
  const auto pose = pose_at(truth, image->timestamp);
  if (!mask.empty() && pose) made.picture = PosedPicture{image, mask, *pose};
  return made;
}

/// Keeps the pictures around the one to be measured next, and measures it as soon as its partners
/// are there.
class SpeedWriter {
 public:
  SpeedWriter(const Camera& camera, const SpeedOptions& options, fs::path folder)
      : camera_(camera), options_(options), folder_(std::move(folder)) {}

  void push(Candidate newest) {
    pictures_.push_back(std::move(newest));
    const double needed = std::max(options_.lapse, options_.second_lapse);
    while (lapse(pictures_[next_], pictures_.back()) >= needed) {
      measure(pictures_[next_++]);
      while (lapse(pictures_.front(), pictures_[next_]) > 2 * needed) {
        pictures_.pop_front();
        --next_;
      }
    }
  }
  /// The last pictures, against earlier ones.
  void finish() {
    for (; next_ < pictures_.size(); ++next_) measure(pictures_[next_]);
  }
  std::size_t written() const { return written_; }

 private:
  static double lapse(const Candidate& a, const Candidate& b) {
    constexpr double kRounding = 1e-3;  // of stamps [s]
    return b.image->timestamp - a.image->timestamp + kRounding;
  }
  /// The first picture so much later, else the last one so much earlier, else (in the middle of a
  /// short sequence) the same for half the time; null if there is none.
  const PosedPicture* partner(const Candidate& of, double seconds) const {
    for (const double least : {seconds, seconds / 2}) {
      if (const PosedPicture* later = first_later(of, least)) return later;
      if (const PosedPicture* earlier = last_earlier(of, least)) return earlier;
    }
    return nullptr;
  }
  const PosedPicture* first_later(const Candidate& of, double seconds) const {
    const auto found = std::find_if(pictures_.begin(), pictures_.end(), [&](const Candidate& c) {
      return c.picture && lapse(of, c) >= seconds;
    });
    return found != pictures_.end() ? &*found->picture : nullptr;
  }
  const PosedPicture* last_earlier(const Candidate& of, double seconds) const {
    const auto found = std::find_if(pictures_.rbegin(), pictures_.rend(), [&](const Candidate& c) {
      return c.picture && lapse(c, of) >= seconds;
    });
    return found != pictures_.rend() ? &*found->picture : nullptr;
  }
  void measure(const Candidate& of) {
    if (!of.picture) return;
    cv::Mat speed;
    for (const double seconds : {options_.lapse, options_.second_lapse}) {
      const PosedPicture* other = partner(of, seconds);
      if (other == nullptr) continue;
      const cv::Mat one = measure_speed(*of.picture, *other, camera_, options_);
      speed = speed.empty() ? one : cv::Mat(cv::max(speed, one));
    }
    if (!speed.empty()) write(of.image->timestamp, speed);
  }
  void write(double timestamp, const cv::Mat& speed) {
    const fs::path file = folder_ / fmt::format("{:.6f}.png", timestamp);
    if (!cv::imwrite(file.string(), speed_image(speed))) {
      throw Error("cannot be written", file.string(), "check the folder and the disk");
    }
    ++written_;
  }

  const Camera camera_;
  const SpeedOptions options_;
  const fs::path folder_;
  std::deque<Candidate> pictures_;
  std::size_t next_ = 0;  // of `pictures_`, to be measured
  std::size_t written_ = 0;
};

}  // namespace

cv::Mat measure_speed(const PosedPicture& from, const PosedPicture& to, const Camera& camera,
                      const SpeedOptions& options) {
  cv::Mat1f speed = cv::Mat1f::zeros(from.mask.size());
  if (cv::countNonZero(from.mask) == 0) return speed;
  const double seconds = std::abs(to.image->timestamp - from.image->timestamp);
  const Displacements found = displacements(from, to, camera, options, seconds);
  const cv::Mat1f local = local_lengths(found, options);
  cv::Mat1i pieces;
  const int count = cv::connectedComponents(from.mask != 0, pieces, 8, CV_32S);
  const std::vector<double> whole = piece_lengths(found, pieces, count);
  for (int v = 0; v < speed.rows; ++v) {
    for (int u = 0; u < speed.cols; ++u) {
      if (pieces(v, u) == 0) continue;
      const double piece = whole[static_cast<std::size_t>(pieces(v, u))];
      const double length = local(v, u) >= 0 ? local(v, u) : piece;
      speed(v, u) = static_cast<float>(length >= 0 ? length / seconds : options.max_speed);
    }
  }
  return speed;
}

std::size_t write_speeds(FrameSource& source, const StampedImages& masks, const Trajectory& truth,
                         const fs::path& folder, const SpeedOptions& options,
                         const std::function<void()>& done) {
  constexpr double kShortest = 0.01;  // [s]: noise divided by less says nothing
  if (std::min(options.lapse, options.second_lapse) < kShortest) {
    throw Error("lapses must be at least 0.01 s", "SpeedOptions", "0.2 and 0.3 s are usual");
  }
  const fs::path unfinished = folder.string() + ".part";
  make_output_folder(unfinished);
  SpeedWriter writer(source.camera(), options, unfinished);
  while (const RgbdFramePtr image = source.next()) {
    writer.push(candidate(image, masks, truth));
    if (done) done();
  }
  writer.finish();
  if (writer.written() == 0) {
    throw Error("no two frames have both a mask and a true pose", folder.string(),
                "check that masks, frames and true trajectory belong together");
  }
  std::error_code failed;
  fs::rename(unfinished, folder, failed);
  if (failed) {
    throw Error("cannot be made (" + failed.message() + ")", folder.string(),
                "name a folder that does not exist yet");
  }
  return writer.written();
}

}  // namespace stillmap
