// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/test_path.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/map/map_file.hpp"
#include "stillmap/pipeline/calibrate_shutter.hpp"
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/pipeline/recovered_run.hpp"
#include "stillmap/pipeline/run_journal.hpp"

#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Error of the inverse depth at a pixel, with a mean of about zero over the image [1/m].
double true_error(const Camera& c, double u, double v) {
  const double x = u / c.width - 0.5, y = v / c.height - 0.5;
  return 0.05 * x - 0.03 * y + 0.06 * x * y;
}

/// Images of a room without people, whose depths have that error.
const recorded::Recording& recording() {
  static const recorded::Recording made = [] {
    recorded::Recording r = recorded::recording(0, "rpy");
    const Camera& camera = r.sequence->camera();
    for (RgbdFramePtr& frame : r.frames) {
      auto changed = std::make_shared<RgbdFrame>(*frame);
      changed->depth = frame->depth.clone();
      changed->depth.forEach<float>([&](float& z, const int* p) {
        if (z > 0) z = static_cast<float>(1 / (1 / z + true_error(camera, p[1], p[0])));
      });
      frame = changed;
    }
    return r;
  }();
  return made;
}

SlamParameters parameters(bool remove_depth_error) {
  Options options = read_options("fused");
  options.dense.enabled = options.movers.enabled = false;
  if (!remove_depth_error) std::erase(options.tracking.extensions, "depth-error");
  return parameters_of(options);
}

void push_all(SlamSystem& slam) {
  for (const RgbdFramePtr& frame : recording().frames) slam.push(frame);
}

double error_of(const SlamResult& result) {
  return absolute_trajectory_error(recording().sequence->trajectory(), result.trajectory)
      .translation.rmse;
}

MapContent content_of(SlamSystem& slam) { return slam.saved_map("a test").map; }

TEST(DepthError, IsRemovedSoThatPosesAreBetter) {
  SlamSystem with(recording().sequence->camera(), parameters(false), nullptr);
  SlamSystem without(recording().sequence->camera(), parameters(true), nullptr);
  push_all(with);
  push_all(without);
  EXPECT_EQ(content_of(with).depth_error, nullptr);
  const MapContent map = content_of(without);
  ASSERT_TRUE(map.depth_error);
  const Camera& c = recording().sequence->camera();
  double squares = 0, left = 0;
  for (int v = 30; v < c.height; v += 30) {
    for (int u = 30; u < c.width; u += 30) {
      const double truth = true_error(c, u, v);
      squares += truth * truth;
      left += std::pow(truth - map.depth_error->at(u, v, {c.width, c.height}), 2);
    }
  }
  EXPECT_LT(std::sqrt(left / squares), 0.5) << "share of the error that is left";
  const double before = error_of(with.finish()), after = error_of(without.finish());
  EXPECT_LT(after, 0.8 * before) << before;
}

TEST(DepthError, OfASavedMapIsKnownFromTheFirstFrame) {
  SlamSystem first(recording().sequence->camera(), parameters(true), nullptr);
  push_all(first);
  const SavedMap saved = first.saved_map("a test");
  ASSERT_TRUE(saved.map.depth_error);
  SlamSystem second(recording().sequence->camera(), parameters(true), nullptr,
                    StartingMap{saved, false});
  for (std::size_t i = 0; i < 10; ++i) second.push(recording().frames[i]);
  const FramePtr& frame = second.newest()->frame;
  ASSERT_TRUE(frame->depth_error);
  EXPECT_EQ(frame->depth_error->nodes(), saved.map.depth_error->nodes());
}

TEST(DepthError, IsInTheJournalWithTheKeypoints) {
  const auto file = test::own_path("depth_error.journal");
  SlamSystem slam(recording().sequence->camera(), parameters(true), nullptr);
  RunJournal journal(slam, file, {"a test", "", "", ""}, std::chrono::milliseconds(0));
  for (const RgbdFramePtr& frame : recording().frames) {
    slam.push(frame);
    journal.add_newest();
  }
  journal.flush();
  const MapContent map = content_of(slam);
  ASSERT_TRUE(map.depth_error);
  EXPECT_EQ(map_sections(recovered_run(file).map.map), map_sections(map));
}

TEST(DepthError, IsLeftToTheUserWhoCalibrates) {
  EXPECT_FALSE(tracking_only(parameters(true)).mapper.remove_depth_error);
}

}  // namespace
}  // namespace stillmap
