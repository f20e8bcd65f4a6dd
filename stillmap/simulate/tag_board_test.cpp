// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/tag/tag_detector.hpp"

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using Eigen::Vector3d;

SimulationOptions with_tags(const std::string& scene, int tags) {
  SimulationOptions options;
  options.scene = scene;
  options.tags = tags;
  options.people = 0;
  options.camera = "loop";
  options.noise = false;
  return options;
}

Vector3d center(const PlacedTag& tag) {
  return (tag.corners[0] + tag.corners[1] + tag.corners[2] + tag.corners[3]) / 4;
}

double largest_side(const Tag& tag) {
  double largest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    largest = std::max(largest, cv::norm(tag.corners[i] - tag.corners[(i + 1) % 4]));
  return largest;
}

/// A tag in the image where it is largest and not cut off.
struct BestView {
  double side = 0;   ///< Largest side [pixels]; 0: seen in no frame.
  double error = 0;  ///< Largest error of a corner [pixels].
};

/// Compares a detected tag with the projection of its true corners.
BestView compare(const Tag& seen, const PlacedTag& tag, const Camera& camera,
                 const Pose& T_world_camera) {
  constexpr double kBorder = 8;  // pixels
  BestView view{largest_side(seen), 0};
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Vector2d truth = camera.project(T_world_camera.inverse() * tag.corners[i]);
    if (!camera.contains(truth.x(), truth.y(), kBorder)) return {};
    view.error = std::max(view.error,
                          std::hypot(seen.corners[i].x - truth.x(), seen.corners[i].y - truth.y()));
  }
  return view;
}

std::vector<BestView> best_views(const SimulatedSequence& sequence) {
  const TagDetector detector("tag36h11");
  const std::vector<PlacedTag>& tags = sequence.scene().tags;
  std::vector<BestView> best(tags.size());
  for (std::size_t i = 0; i < sequence.frames(); ++i) {
    for (const Tag& seen : detector.detect(sequence.frame(i)->gray)) {
      if (seen.name.id >= tags.size()) continue;
      const BestView view =
          compare(seen, tags[seen.name.id], sequence.camera(), sequence.T_world_camera(i));
      if (view.side > best[seen.name.id].side) best[seen.name.id] = view;
    }
  }
  return best;
}

/// A way once around; few frames per second for a fast test.
struct Way {
  const char* name;
  SimulationOptions options;
  double seconds, fps;
};

void PrintTo(const Way& way, std::ostream* out) { *out << way.name; }

class TagBoards : public testing::TestWithParam<Way> {};

TEST_P(TagBoards, AreDetectedOnTheWayWhereTheirCornersAre) {
  SimulationOptions options = GetParam().options;
  options.fps = GetParam().fps;
  options.frames = static_cast<int>(GetParam().seconds * GetParam().fps);
  const SimulatedSequence sequence(options);
  ASSERT_EQ(sequence.scene().tags.size(), static_cast<std::size_t>(options.tags));
  const std::vector<BestView> views = best_views(sequence);
  for (const PlacedTag& tag : sequence.scene().tags) {
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_NEAR((tag.corners[(i + 1) % 4] - tag.corners[i]).norm(), 0.2, 1e-5) << tag.id;
    EXPECT_GT(views[tag.id].side, 0) << tag.id << " is not seen";
    // The mean error of the detector's corners is 0.13 pixels.
    EXPECT_LT(views[tag.id].error, 0.5) << tag.id;
  }
}

Way way(const char* name, const char* scene, int tags, double seconds, double fps) {
  return {name, with_tags(scene, tags), seconds, fps};
}

Way second_visit() {
  Way office = way("office_rearranged", "office", 12, 28, 2);
  office.options.visit = 2;
  return office;
}

Way below_the_crane() {
  Way yard = way("yard", "yard", 9, 36, 1);
  yard.options.camera = "trolley";
  return yard;
}

INSTANTIATE_TEST_SUITE_P(TagBoards, TagBoards,
                         testing::Values(way("office", "office", 12, 28, 2), second_visit(),
                                         way("flat", "flat", 12, 160, 0.5), below_the_crane()),
                         [](const auto& way) { return std::string(way.param.name); });

/// Returns the image of a camera at 1 m in front of a tag.
cv::Mat close_up(const SimulatedSequence& sequence, const PlacedTag& tag) {
  const Vector3d out = (tag.corners[1] - tag.corners[0]).normalized().cross(Vector3d::UnitZ());
  const std::array<const simulate::Mesh*, 1> meshes{&sequence.scene().statics};
  const simulate::Rendering rendering =
      simulate::render(sequence.camera(), look_at(center(tag) + out, center(tag)), meshes,
                       sequence.scene().textures);
  cv::Mat color, gray;
  rendering.color.convertTo(color, CV_8UC3);
  cv::cvtColor(color, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

TEST(TagBoard, ItsEdgesAreSharpAtOneMeter) {
  const SimulatedSequence sequence(with_tags("office", 1));
  const cv::Mat gray = close_up(sequence, sequence.scene().tags.front());
  // The tag is in the middle of the image; its border is 13 pixels wide, like its margin.
  const int row = gray.rows / 2;
  const int left = static_cast<int>(std::lround(sequence.camera().cx - 0.1 * sequence.camera().fx));
  const double margin = gray.at<std::uint8_t>(row, left - 7);
  const double border = gray.at<std::uint8_t>(row, left + 7);
  EXPECT_GT(margin - border, 80);
  EXPECT_NEAR(gray.at<std::uint8_t>(row, left - 2), margin, 0.1 * (margin - border));
  EXPECT_NEAR(gray.at<std::uint8_t>(row, left + 2), border, 0.1 * (margin - border));
}

TEST(TagBoard, LeavesAllElseAsItIsWithoutOne) {
  SimulationOptions options = with_tags("office", 0);
  options.people = 2;
  const SimulatedSequence without(options);
  EXPECT_TRUE(without.scene().tags.empty());
  options.tags = 12;
  const SimulatedSequence with(options);
  int covered = 0;
  for (const std::size_t i : {0U, 150U, 290U}) {
    const SimulatedFrame a = without.at(i), b = with.at(i);
    cv::Mat difference, boards = cv::Mat::zeros(a.frame->gray.size(), CV_8UC1);
    cv::absdiff(a.frame->gray, b.frame->gray, difference);
    for (const PlacedTag& tag : with.scene().tags) {
      std::vector<cv::Point> outline;
      for (const Vector3d& corner : tag.corners) {
        // The board is 1.28 times as large; the rest is for its thickness and its edges.
        const Vector3d p =
            b.truth.T_world_camera.inverse() * (center(tag) + 1.5 * (corner - center(tag)));
        if (p.z() < 0.1) continue;
        const Eigen::Vector2d uv = with.camera().project(p);
        outline.emplace_back(cvRound(uv.x()), cvRound(uv.y()));
      }
      if (outline.size() == 4) cv::fillConvexPoly(boards, outline, 255);
    }
    covered += cv::countNonZero(difference);
    EXPECT_EQ(cv::countNonZero(difference & ~boards), 0) << i;
    EXPECT_EQ(cv::norm(a.truth.instances, b.truth.instances, cv::NORM_INF), 0) << i;
  }
  EXPECT_GT(covered, 1000);  // Tags are seen in these frames.
}

TEST(TagBoard, MoreThanThereArePlacesAreAnError) {
  EXPECT_THROW(SimulatedSequence(with_tags("office", 13)), Error);
  EXPECT_THROW(SimulatedSequence(with_tags("yard", 10)), Error);
  EXPECT_THROW(SimulatedSequence(with_tags("flat", -1)), Error);
}

}  // namespace
}  // namespace stillmap
