// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/segment/inference_engine.hpp"

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>
#include <vector>

#include "command_tree.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#include "terminal.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <opencv2/core/utility.hpp>
#include <opencv2/core/utils/logger.hpp>

namespace stillmap {
namespace {

/// Returns the version with the commit and the libraries that run networks.
std::string version_text() {
  const std::string commit = STILLMAP_COMMIT;
  return fmt::format("Stillmap {}{}\nnetworks run with: {}", STILLMAP_VERSION,
                     commit.empty() ? "" : " (commit " + commit + ")",
                     fmt::join(available_backends(), ", "));
}

/// Returns the words of the command line; those of `help` and `help COMMAND` as with --help.
std::vector<std::string> words_of(int argc, char** argv) {
  std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
  if (words.empty() || words.front() != "help") return words;
  words.erase(words.begin());
  words.push_back("--help");
  return words;
}

/// Returns why a command line cannot be read, with a fix.
std::string refusal(const CLI::App& app, const std::vector<std::string>& words,
                    const CLI::ParseError& error) {
  if (const auto unknown = unknown_word(app, words)) return unknown->what();
  if (const auto wrong = wrong_number(app, error.what())) return wrong->what();
  return fmt::format("stillmap: {}\n  fix: see {} --help", error.what(), called_command(app).path);
}

int run(int argc, char** argv) {
  int exit_code = kSuccess;
  CLI::App app(
      "Stillmap: RGB-D SLAM for dynamic scenes.\n"
      "It estimates the camera trajectory, a static dense map, and tracked moving objects from a "
      "recording.");
  app.formatter(make_help_formatter());
  app.set_version_flag("-V,--version", version_text);
  app.require_subcommand(1);
  app.footer(
      "`stillmap COMMAND --help` shows a command's options and examples.\n"
      "Exit codes:\n"
      "  0    done\n"
      "  1    an error, with its reason and a fix\n"
      "  2    the command line is wrong\n"
      "  3    done, but the result should not be trusted: see the reasons\n"
      "  130  interrupted; the results so far are saved");
  add_run_command(app, exit_code);
  add_batch_command(app, exit_code);
  add_view_command(app, exit_code);
  add_warn_command(app, exit_code);
  add_recover_command(app, exit_code);
  add_dense_command(app, exit_code);
  add_eval_command(app, exit_code);
  add_compare_command(app, exit_code);
  add_simulate_command(app, exit_code);
  add_demo_command(app, exit_code);
  add_calibrate_command(app, exit_code);
  add_doctor_command(app, exit_code);
  add_info_command(app, exit_code);
  add_record_command(app, exit_code);
  add_map_command(app, exit_code);
  add_presets_command(app, exit_code);
  add_options_command(app, exit_code);
  add_findings_command(app, exit_code);
  add_man_command(app);
  add_completion_command(app);
  name_value_types(app);
  const std::vector<std::string> words = words_of(argc, argv);
  try {
    app.name(argc > 0 ? argv[0] : "stillmap");
    app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0 && !unknown_word(app, words)) return app.exit(e);
    print_error("{}\n", refusal(app, words, e));
    return kUsage;
  }
  return exit_code;
}

/// Prints why the program ends.
void tell(const std::exception_ptr& failure) {
  const auto lack_of_memory = [] {
    print_error(
        "stillmap: out of memory\n  fix: map fewer frames, or use fewer pixels: --set "
        "dense.stride=4\n");
  };
  const auto defect = [](const std::exception& e) {
    print_error("stillmap: unexpected: {}\n  fix: this is a defect; please report it\n", e.what());
  };
  try {
    std::rethrow_exception(failure);
  } catch (const Error& e) {
    print_error("stillmap: {}\n", e.what());
  } catch (const std::filesystem::filesystem_error& e) {
    print_error("stillmap: {}: {}\n  fix: check the path\n", e.path1().string(),
                e.code().message());
  } catch (const std::bad_alloc&) {
    lack_of_memory();
  } catch (const std::system_error& e) {
    e.code() == std::errc::resource_unavailable_try_again ? lack_of_memory() : defect(e);
  } catch (const cv::Exception& e) {
    e.code == cv::Error::StsNoMem ? lack_of_memory() : defect(e);
  } catch (const std::exception& e) {
    defect(e);
  }
}

/// Called where an exception cannot be passed on, as when a thread of a library finds no memory.
[[noreturn]] void end_early() {
  const auto failure = std::current_exception();
  if (!failure) std::abort();
  tell(failure);
  std::_Exit(kFailure);
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  cv::utils::logging::setLogLevel(
      cv::utils::logging::LOG_LEVEL_SILENT);  // Messages of OpenCV are reported as Error.
  // Each stage has its own thread; for images of camera size OpenCV's threads mostly wait for each
  // other.
  cv::setNumThreads(1);
  stillmap::survive_failed_outputs();
  std::set_terminate(stillmap::end_early);
  try {
    const int exit_code = stillmap::run(argc, argv);
    if (stillmap::output_is_complete()) return exit_code;
    stillmap::print_error("stillmap: standard output: not all text could be written\n");
  } catch (...) {
    stillmap::tell(std::current_exception());
  }
  return stillmap::kFailure;
}
