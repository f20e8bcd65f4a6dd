// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"

#include <new>

#include "commands.hpp"
#include <fmt/format.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/utils/logger.hpp>

namespace {

int run(int argc, char** argv) {
  using namespace stillmap;
  int exit_code = kSuccess;
  CLI::App app(
      "Stillmap: visual SLAM for RGB-D cameras in scenes where things move.\n"
      "A recorded sequence goes in; trajectory, static dense map and error figures come out.");
  app.set_version_flag("--version", STILLMAP_VERSION);
  app.require_subcommand(1);
  app.footer("`stillmap COMMAND --help` shows a command's options and examples.");
  add_run_command(app, exit_code);
  add_dense_command(app, exit_code);
  add_eval_command(app, exit_code);
  add_compare_command(app, exit_code);
  add_simulate_command(app, exit_code);
  add_demo_command(app, exit_code);
  add_doctor_command(app, exit_code);
  add_map_command(app, exit_code);
  add_vocabulary_command(app, exit_code);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kSuccess : kUsage;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  cv::utils::logging::setLogLevel(
      cv::utils::logging::LOG_LEVEL_SILENT);  // what it says comes back as Error
  // Each stage has a thread of its own already; for images as small as a camera's, OpenCV's threads
  // wait longer for each other than they work.
  cv::setNumThreads(1);
  try {
    return run(argc, argv);
  } catch (const stillmap::Error& e) {
    fmt::print(stderr, "stillmap: {}\n", e.what());
  } catch (const std::bad_alloc&) {
    fmt::print(stderr,
               "stillmap: out of memory\n  fix: map fewer frames, or set dense.max_pixels lower\n");
  } catch (const std::exception& e) {
    fmt::print(stderr, "stillmap: unexpected: {}\n  fix: this is a defect; please report it\n",
               e.what());
  }
  return stillmap::kFailure;
}
