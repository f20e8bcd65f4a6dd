// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/measured_speed.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/motion_truth.hpp"
#include "stillmap/evaluate/pose_at.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

/// Times between the two images that are compared [s]. The higher speed of both pairs counts, so
/// that an object that swings back within one lapse is not taken for static.
constexpr double kLapse = 0.2, kSecondLapse = 0.3;
/// Side of the square over which displacements are averaged [pixels].
constexpr int kWindow = 25;
/// Width of the band at mask outlines without displacements [pixels].
constexpr int kOutlineMargin = 4;
/// Faster displacements are rejected as errors of the flow [m/s].
constexpr double kMaxSpeed = 4;
/// Share of a window that must have displacements [0..1].
constexpr double kMinSupport = 0.1;
/// Rounding error of timestamps [s].
constexpr double kRounding = 1e-3;

cv::Mat flow_between(const cv::Mat& from, const cv::Mat& to) {
  cv::Mat flow;
  cv::DISOpticalFlow::create(cv::DISOpticalFlow::PRESET_MEDIUM)->calc(from, to, flow);
  return flow;
}

/// Returns the pixels inside the mask that are more than `margin` pixels from its outline.
cv::Mat inside(const cv::Mat& mask, int margin) {
  cv::Mat eroded;
  const cv::Size square(2 * margin + 1, 2 * margin + 1);
  cv::erode(mask != 0, eroded, cv::getStructuringElement(cv::MORPH_RECT, square));
  return eroded;
}

/// Displacements of pixels in the world.
struct Displacements {
  cv::Mat3f vectors;  // [m]
  cv::Mat1b known;    // 255 at pixels with a displacement, else 0
};

/// Returns the displacement in the world [m] of pixel (u, v) between the two images; none if a
/// depth is unknown, or the pixel leaves the image or the mask.
std::optional<Eigen::Vector3d> displacement(const PosedImage& from, const PosedImage& to,
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

Displacements displacements(const PosedImage& from, const PosedImage& to, const Camera& camera,
                            double seconds) {
  const cv::Mat flow = flow_between(from.image->gray, to.image->gray);
  const cv::Mat sound = inside(from.mask, kOutlineMargin),
                sound_in_to = inside(to.mask, kOutlineMargin);
  Displacements found{cv::Mat3f::zeros(flow.size()), cv::Mat1b::zeros(flow.size())};
  for (int v = 0; v < flow.rows; ++v) {
    for (int u = 0; u < flow.cols; ++u) {
      if (sound.at<std::uint8_t>(v, u) == 0) continue;
      const auto d = displacement(from, to, camera, sound_in_to, u, v, flow.at<cv::Vec2f>(v, u));
      if (!d || d->norm() > kMaxSpeed * seconds) continue;
      found.vectors(v, u) = {static_cast<float>(d->x()), static_cast<float>(d->y()),
                             static_cast<float>(d->z())};
      found.known(v, u) = 255;
    }
  }
  return found;
}

/// Returns the length of the mean displacement [m] in the window around each pixel; negative if too
/// few are known.
cv::Mat1f local_lengths(const Displacements& d) {
  const cv::Size window(kWindow, kWindow);
  cv::Mat3f sums;
  cv::Mat1f support;
  cv::blur(d.vectors, sums, window);
  cv::blur(cv::Mat1f(d.known) / 255, support, window);
  cv::Mat1f lengths(support.size(), -1);
  for (int v = 0; v < lengths.rows; ++v) {
    for (int u = 0; u < lengths.cols; ++u) {
      if (support(v, u) < kMinSupport) continue;
      lengths(v, u) = static_cast<float>(cv::norm(sums(v, u)) / support(v, u));
    }
  }
  return lengths;
}

/// Returns the length of the mean displacement [m] of each piece of the mask; negative if the piece
/// has none.
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

/// An image of the sequence, with mask and true pose if it has both.
struct Candidate {
  RgbdFramePtr image;
  std::optional<PosedImage> posed;
};

Candidate candidate(const RgbdFramePtr& image, const StampedImages& masks,
                    const Trajectory& truth) {
  Candidate made{image, std::nullopt};
  const cv::Mat mask = masks.at(image->timestamp);
  const auto pose = pose_at(truth, image->timestamp);
  if (!mask.empty() && pose) made.posed = PosedImage{image, mask, *pose};
  return made;
}

/// Keeps the images around the next one to be measured, and measures it as soon as the images to
/// compare it with have arrived.
class SpeedWriter {
 public:
  SpeedWriter(const Camera& camera, fs::path folder)
      : camera_(camera), folder_(std::move(folder)) {}

  void push(Candidate newest) {
    candidates_.push_back(std::move(newest));
    constexpr double kNeeded = std::max(kLapse, kSecondLapse);
    while (lapse(candidates_[next_], candidates_.back()) >= kNeeded) {
      measure(candidates_[next_++]);
      while (lapse(candidates_.front(), candidates_[next_]) > 2 * kNeeded) {
        candidates_.pop_front();
        --next_;
      }
    }
  }
  /// Measures the last images, which are compared with earlier ones.
  void finish() {
    for (; next_ < candidates_.size(); ++next_) measure(candidates_[next_]);
  }
  std::size_t written() const { return written_; }

 private:
  static double lapse(const Candidate& a, const Candidate& b) {
    return b.image->timestamp - a.image->timestamp + kRounding;
  }
  /// Returns the first image at least `seconds` later, else the last one at least `seconds`
  /// earlier, else (in the middle of a short sequence) the same for half the time; null if there is
  /// none.
  const PosedImage* partner(const Candidate& of, double seconds) const {
    for (const double least : {seconds, seconds / 2}) {
      if (const PosedImage* later = first_later(of, least)) return later;
      if (const PosedImage* earlier = last_earlier(of, least)) return earlier;
    }
    return nullptr;
  }
  const PosedImage* first_later(const Candidate& of, double seconds) const {
    const auto found =
        std::find_if(candidates_.begin(), candidates_.end(),
                     [&](const Candidate& c) { return c.posed && lapse(of, c) >= seconds; });
    return found != candidates_.end() ? &*found->posed : nullptr;
  }
  const PosedImage* last_earlier(const Candidate& of, double seconds) const {
    const auto found =
        std::find_if(candidates_.rbegin(), candidates_.rend(),
                     [&](const Candidate& c) { return c.posed && lapse(c, of) >= seconds; });
    return found != candidates_.rend() ? &*found->posed : nullptr;
  }
  void measure(const Candidate& of) {
    if (!of.posed) return;
    cv::Mat speed;
    for (const double seconds : {kLapse, kSecondLapse}) {
      const PosedImage* other = partner(of, seconds);
      if (other == nullptr) continue;
      const cv::Mat one = measure_speed(*of.posed, *other, camera_);
      speed = speed.empty() ? one : cv::Mat(cv::max(speed, one));
    }
    if (!speed.empty()) write(of.image->timestamp, speed);
  }
  void write(double timestamp, const cv::Mat& speed) {
    write_png(folder_ / fmt::format("{:.6f}.png", timestamp), speed_image(speed));
    ++written_;
  }

  const Camera camera_;
  const fs::path folder_;
  std::deque<Candidate> candidates_;
  std::size_t next_ = 0;  // index in candidates_ of the image to be measured next
  std::size_t written_ = 0;
};

}  // namespace

cv::Mat measure_speed(const PosedImage& from, const PosedImage& to, const Camera& camera) {
  cv::Mat1f speed = cv::Mat1f::zeros(from.mask.size());
  if (cv::countNonZero(from.mask) == 0) return speed;
  const double seconds = std::abs(to.image->timestamp - from.image->timestamp);
  const Displacements found = displacements(from, to, camera, seconds);
  const cv::Mat1f local = local_lengths(found);
  cv::Mat1i pieces;
  const int count = cv::connectedComponents(from.mask != 0, pieces, 8, CV_32S);
  const std::vector<double> whole = piece_lengths(found, pieces, count);
  for (int v = 0; v < speed.rows; ++v) {
    for (int u = 0; u < speed.cols; ++u) {
      if (pieces(v, u) == 0) continue;
      const double piece = whole[static_cast<std::size_t>(pieces(v, u))];
      const double length = local(v, u) >= 0 ? local(v, u) : piece;
      speed(v, u) = static_cast<float>(length >= 0 ? length / seconds : kMaxSpeed);
    }
  }
  return speed;
}

std::size_t write_speeds(FrameSource& source, const StampedImages& masks, const Trajectory& truth,
                         const fs::path& folder, const std::function<void()>& done) {
  const fs::path unfinished = folder.string() + ".part";
  make_output_folder(unfinished);
  SpeedWriter writer(source.camera(), unfinished);
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
