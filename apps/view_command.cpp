// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/print.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/view/recorded_view.hpp"
#include "stillmap/view/static_page.hpp"
#include "stillmap/view/view_server.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <optional>
#include <thread>

#include "commands.hpp"
#include "interrupt.hpp"
#include "output_file.hpp"
#include "view_options.hpp"
#include "warning_options.hpp"
#include "warning_replay.hpp"

namespace stillmap {
namespace {

struct ViewArguments {
  std::string run;
  int port = ViewAddress().port;
  std::string address, zones, html;
  bool force = false;
  std::vector<double> hook_offset;
};

bool is_run(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "movers.csv");
}

/// Returns the rules of --zones; without it those of the run, if it had any.
std::optional<WarningRules> rules_of(const ViewArguments& arguments) {
  const std::filesystem::path run = arguments.run;
  if (arguments.zones.empty() && !std::filesystem::exists(run / kRunRules)) return std::nullopt;
  if (is_run(run)) return rules_for(run, arguments.zones, arguments.hook_offset);
  return read_warning_rules(arguments.zones.empty() ? (run / kRunRules).string() : arguments.zones,
                            hook_at(arguments.hook_offset));
}

bool has_distance_to(const WarningRules& rules, const std::string& point) {
  return std::any_of(rules.distances.begin(), rules.distances.end(),
                     [&](const DistanceRule& rule) { return rule.point == point; });
}

/// Whether the options change the rules of the run, so that its own events are not theirs.
bool changes_rules(const ViewArguments& arguments, const WarningRules& rules) {
  if (!arguments.zones.empty()) return true;
  const NamedPoints hook = hook_at(arguments.hook_offset);
  return !hook.empty() && has_distance_to(rules, hook.begin()->first);
}

/// Returns what the page draws: the rules and, if none of them is for the point of --hook-offset,
/// the point alone, as a distance of 0 m.
std::optional<WarningRules> drawn_rules(std::optional<WarningRules> rules,
                                        const std::vector<double>& hook_offset) {
  for (const auto& [name, offset] : hook_at(hook_offset)) {
    if (!rules) rules.emplace();
    if (has_distance_to(*rules, name)) continue;
    DistanceRule& rule = rules->distances.emplace_back();
    rule.name = rule.point = name;
    rule.offset = offset;
    rule.nearer = 0;
    rule.level = true;
  }
  return rules;
}

void publish(const ViewArguments& arguments, TopicBoard& board) {
  const std::optional<WarningRules> rules = rules_of(arguments);
  publish_recorded_run(arguments.run, drawn_rules(rules, arguments.hook_offset), board);
  if (rules && is_run(arguments.run) && changes_rules(arguments, *rules))
    board.publish(events_message(warnings_of(replayed_events(*rules, arguments.run))));
}

int view(const ViewArguments& arguments) {
  catch_interrupt();
  if (std::filesystem::is_directory(arguments.run)) require_ended_run(arguments.run);
  if (!arguments.html.empty()) {
    require_replaceable(arguments.html, is_static_page, arguments.force);
    TopicBoard board;
    publish(arguments, board);
    write_named(arguments.html, static_page(board), is_static_page, arguments.force);
    return kSuccess;
  }
  ViewServer server(*view_address_of(
      {.port = arguments.port, .address = arguments.address, .port_option = "--port"}));
  publish(arguments, server.board());
  print_out("{}Ctrl-C ends it\n", addresses_text(server));
  output_is_complete();
  while (!interrupted()) std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return kSuccess;
}

}  // namespace

void add_view_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ViewArguments>();
  CLI::App* command = app.add_subcommand(
      "view", "show the results of a run, a saved map, changes or a cloud in a browser");
  command
      ->add_option("run", arguments->run,
                   "folder of results of stillmap run or stillmap map changes, saved map, or cloud "
                   "(.ply)")
      ->required();
  command->add_option("--port", arguments->port, "port of the page; 0: any free one")
      ->capture_default_str();
  add_view_address(*command, arguments->address);
  command->add_option("--zones", arguments->zones,
                      "also show the zones of this file, and their events in the run instead of "
                      "those of the run itself; default: the zones of the run");
  add_hook_offset(*command, arguments->hook_offset);
  command
      ->add_option("--html", arguments->html,
                   "write the page with its data to one file, which any browser opens without "
                   "Stillmap and without a network, instead of serving it")
      ->type_name("FILE")
      ->excludes("--port")
      ->excludes("--view-address");
  add_force_option(*command, arguments->force);
  command->footer(
      "Examples:\n"
      "  stillmap view results\n"
      "  stillmap view results --html results.html\n"
      "  stillmap view office.map --view-address 0.0.0.0\n"
      "docs/view.md explains the page; `stillmap run --view` shows a run in progress.");
  command->callback([arguments, &exit_code] { exit_code = view(*arguments); });
}

}  // namespace stillmap
