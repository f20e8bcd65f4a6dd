// SPDX-License-Identifier: Apache-2.0
#include "crane_experiment.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/evaluate/crane_table.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/simulate/tum_writer.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>

#include "interrupt.hpp"
#include "progress.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kName = "crane";
/// Yards without movers, with movers, and also with a load on the hook that fills a third of the
/// view.
constexpr const char *kStatic = "yard_static", *kLoaded = "yard_loaded";
constexpr std::array kYards{kStatic, "yard_dynamic", kLoaded};
constexpr double kFps = 15;   // Hz
constexpr int kFrames = 526;  // of one round of the trolley, which takes 35 s

/// The paper's camera, at the wanted width.
SimulationOptions yard_options(const std::string& name, int width) {
  const bool dynamic = name != kStatic;
  SimulationOptions options;
  options.scene = "yard";
  options.camera = "trolley";
  options.people = dynamic ? 3 : 0;
  options.things = dynamic ? 3 : 0;
  options.near_things = name == kLoaded;
  options.camera_model = "realsense_d435i";
  options.width = width;
  options.fps = kFps;
  options.frames = kFrames;
  return options;
}

struct Interrupted {};

/// Renders a yard into a folder. Throws Interrupted.
void render(const SimulationOptions& options, const std::string& name, const fs::path& folder) {
  make_output_folder(folder.parent_path());
  const SimulatedSequence sequence(options);
  Progress progress("rendering " + name, sequence.frames());
  write_tum_layout(sequence, folder, [&](std::size_t) {
    if (interrupted()) throw Interrupted();
    progress.step();
    return true;
  });
}

/// Returns whether an earlier start rendered the yard completely, in this width: its list of images
/// is written last.
bool is_rendered(const fs::path& folder, int width) {
  return fs::exists(folder / "rgb.txt") && fs::exists(folder / "camera.yaml") &&
         read_camera((folder / "camera.yaml").string()).width == width;
}

bool is_yard(const BenchmarkSequence& sequence) {
  return std::find(kYards.begin(), kYards.end(), sequence.name) != kYards.end();
}

/// Returns the yards of the data folder, or renders them. Throws Interrupted.
std::vector<BenchmarkSequence> yards_of(const ReproduceArguments& arguments) {
  std::vector<BenchmarkSequence> yards;
  if (!arguments.data.empty()) yards = find_benchmark_sequences(arguments.data);
  std::erase_if(yards, [](const BenchmarkSequence& sequence) { return !is_yard(sequence); });
  if (yards.size() == kYards.size()) return yards;
  const fs::path folder = fs::path(arguments.out) / "sequences";
  for (const char* name : kYards) {
    if (!is_rendered(folder / name, arguments.width))
      render(yard_options(name, arguments.width), name, folder / name);
  }
  return find_benchmark_sequences(folder);
}

}  // namespace

std::vector<std::string> crane_files() {
  return {"crane.md", "crane.tex", "crane.json", "crane_trajectories.png",
          "crane_trajectories.svg"};
}

std::vector<std::string> reproduce_crane(const ReproduceArguments& arguments,
                                         ResultFolder& folder) {
  const Paper& paper = find_paper("seg-mask");
  // Networks trained on COCO detect neither hooks nor the rendered vehicles.
  ReproduceArguments with_masks = arguments;
  with_masks.true_masks = arguments.models.empty() || arguments.true_masks;
  std::vector<std::string> presets{kPaperBaseline};
  for (const Paper& one : papers()) presets.push_back(one.preset);
  presets.emplace_back(kOwnSystem);
  for (const Variant& variant : variants_of(arguments)) presets.push_back(variant.name);
  require_foreign_runs(arguments, std::vector<std::string>(kYards.begin(), kYards.end()));
  std::vector<BenchmarkSequence> yards;
  try {
    yards = yards_of(arguments);
  } catch (const Interrupted&) {
    return {};
  }
  check_models(with_masks, yards, presets);
  const std::vector<FinishedRun> foreign = read_foreign_runs(arguments, yards);
  const std::string reference = foreign.empty() ? kPaperBaseline : foreign.front().figures.preset;
  PresetRunner runner(with_masks, yards, presets);
  runner.run(presets);
  if (interrupted()) return problems_of(runner.finished());
  std::vector<PaperRun> runs = figures_of(runner.finished());
  std::ranges::move(figures_of(foreign), std::back_inserter(runs));
  const FigureTable table = crane_table(paper, runs, reference);
  const std::string protocol = fmt::format(
      "{} Simulated yard, camera realsense_d435i, {}. Improvement rates are over {}.",
      protocol_of(with_masks, runner.finished(), presets),
      with_masks.true_masks ? "true masks of workers, hook and vehicles" : "masks by a network",
      reference);
  std::vector<std::string> systems = presets;
  std::ranges::copy(systems_of(foreign), std::back_inserter(systems));
  const FigureTable ate = summary_tables(runs, systems, reference).front().second;
  const std::string text = fmt::format(
      "# crane: {}\n\n{}\n\n<!-- table: crane -->\n\n{}\n<!-- end of table -->\n\n"
      "<!-- table: ate -->\n\n{}\n<!-- end of table -->\n",
      paper.title, protocol, table_markdown(table), table_markdown(ate));
  print_out("\n{}\n", text);
  folder.write_text("crane.md", text);
  folder.write_text("crane.tex",
                    fmt::format("% {}\n\n{}\n{}", protocol, table_latex(table), table_latex(ate)));
  const nlohmann::json json{{"stillmap", STILLMAP_VERSION},
                            {"paper", kName},
                            {"source", paper.source},
                            {"tables", {table, ate}},
                            {"runs", runs}};
  folder.write_text("crane.json", json_text(json, 2) + "\n");
  write_paths(first_paths(runner.finished(),
                          std::vector<std::string>{kPaperBaseline, paper.preset, kOwnSystem}),
              kName, folder);
  return problems_of(runner.finished());
}

}  // namespace stillmap
