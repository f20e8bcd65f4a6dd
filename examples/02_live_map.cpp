// SPDX-License-Identifier: Apache-2.0
// Follows the map while frames are pushed: subscriptions report events, and a second thread takes
// snapshots. The live cloud after the last frame is written as PLY.
//
//   02_live_map SEQUENCE LIVE_MAP.ply
//
// The frames come from a recording here. A program with a camera of its own pushes OpenCV images
// instead: slam.push(color, depth, timestamp).
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <stillmap/base/error.hpp>
#include <stillmap/dense/cloud.hpp>
#include <stillmap/sensor/make_source.hpp>
#include <stillmap/slam.hpp>
#include <stop_token>
#include <thread>

namespace {

/// Prints the state of the map twice a second, as a viewer would draw it, until it is stopped.
void watch(const stillmap::Slam& slam, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
    const std::shared_ptr<const stillmap::Snapshot> snapshot = slam.snapshot();
    std::cout << "frame " << snapshot->newest.frame_index << ": " << snapshot->trajectory.size()
              << " poses, " << snapshot->keyframes.size() << " keyframes, "
              << snapshot->landmarks.size() << " landmarks, " << snapshot->movers.size()
              << " moving objects, " << snapshot->cloud->size() << " points\n";
  }
}

int run(const char* sequence, const char* cloud_file) {
  const std::unique_ptr<stillmap::FrameSource> source = stillmap::make_source(sequence);
  stillmap::Slam slam(source->camera());

  int keyframes = 0, corrections = 0;  // counted by the thread that pushes: this one
  const stillmap::Subscription on_keyframe =
      slam.on_keyframe([&](const stillmap::KeyframePose&) { ++keyframes; });
  const stillmap::Subscription on_map_changed =
      slam.on_map_changed([&](const stillmap::MapCorrection&) { ++corrections; });

  std::jthread viewer([&slam](const std::stop_token& stop) { watch(slam, stop); });
  while (const stillmap::RgbdFramePtr frame = source->next()) slam.push(frame);
  viewer.request_stop();

  const std::shared_ptr<const stillmap::Snapshot> last = slam.snapshot();
  stillmap::write_ply(cloud_file, *last->cloud);
  const stillmap::Results results = slam.finish();
  std::cout << keyframes << " keyframes, " << corrections << " corrections of the map; "
            << last->cloud->size() << " points live, " << results.cloud->size() << " in the end\n";
  return last->cloud->empty() ? EXIT_FAILURE : EXIT_SUCCESS;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 02_live_map SEQUENCE LIVE_MAP.ply\n";
    return EXIT_FAILURE;
  }
  try {
    return run(argv[1], argv[2]);
  } catch (const stillmap::Error& e) {
    std::cerr << e.what() << '\n';
    return EXIT_FAILURE;
  }
}
