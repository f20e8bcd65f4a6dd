// SPDX-License-Identifier: Apache-2.0
#include <exception>

#include "commands.hpp"
#include <fmt/format.h>
#include <opencv2/core/utility.hpp>

int main(int argc, char** argv) {
  using namespace stillmap::lab;
  cv::setNumThreads(1);  // as the command stillmap does
  CLI::App app(
      "The laboratory of Stillmap: measurements that need the internals of the library,\n"
      "and the programs that made the data in the library. See lab/README.md.");
  app.require_subcommand(1);
  add_kidnap_command(app);
  add_masks_command(app);
  add_merge_scale_command(app);
  add_occlusion_command(app);
  add_loop_cost_command(app);
  add_loop_precision_command(app);
  add_large_map_command(app);
  add_long_run_command(app);
  add_place_recall_command(app);
  add_read_command(app);
  add_speeds_command(app);
  add_vocabulary_command(app);
  add_detect_command(app);
  add_brief_pattern_command(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? 0 : 2;
  } catch (const std::exception& e) {
    fmt::print(stderr, "stillmap_lab: {}\n", e.what());
    return 1;
  }
  return 0;
}
