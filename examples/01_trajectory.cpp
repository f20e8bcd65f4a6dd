// SPDX-License-Identifier: Apache-2.0
// Tracks a recorded RGB-D sequence and writes the camera trajectory with all other results.
//
//   01_trajectory SEQUENCE RESULTS [NETWORK.onnx]
//
// SEQUENCE is a folder in the layout of the TUM RGB-D benchmark with a camera.yaml. The folder
// RESULTS gets the files of `stillmap run --out`, among them trajectory.txt in the benchmark's
// format (timestamp tx ty tz qx qy qz qw), cloud.ply and report.html.
#include <cstdlib>
#include <iostream>
#include <memory>
#include <stillmap/base/error.hpp>
#include <stillmap/sensor/make_source.hpp>
#include <stillmap/slam.hpp>
#include <stillmap/write_results.hpp>

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: 01_trajectory SEQUENCE RESULTS [NETWORK.onnx]\n";
    return EXIT_FAILURE;
  }
  try {
    stillmap::Options options;  // those of preset "fused"
    if (argc > 3) options.network.model = argv[3];

    const std::unique_ptr<stillmap::FrameSource> source = stillmap::make_source(argv[1]);
    stillmap::Slam slam(source->camera(), options);
    while (const stillmap::RgbdFramePtr frame = source->next()) slam.push(frame);

    const stillmap::Results results = slam.finish();
    stillmap::write_results(results, argv[2]);
    std::cout << results.statistics.tracked << " of " << results.statistics.frames
              << " frames tracked, " << results.keyframes.size() << " keyframes, "
              << results.statistics.landmarks << " landmarks\n";
    return results.statistics.tracked > 0 ? EXIT_SUCCESS : EXIT_FAILURE;
  } catch (const stillmap::Error& e) {
    std::cerr << e.what() << '\n';  // the problem, the place and the fix
    return EXIT_FAILURE;
  }
}
