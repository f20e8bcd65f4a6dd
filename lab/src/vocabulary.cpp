// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/feature/vocabulary_training.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <filesystem>

#include "commands.hpp"
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap::lab {
namespace {

namespace fs = std::filesystem;

struct TrainArguments {
  std::vector<std::string> images;
  std::string out = "vocabulary.bin";
  VocabularyTrainingOptions options;
  OrbOptions orb;
};

/// Returns the given files and the files in the given folders, sorted within each folder.
std::vector<fs::path> image_files(const std::vector<std::string>& names) {
  std::vector<fs::path> files;
  for (const std::string& name : names) {
    if (!fs::is_directory(name)) {
      files.emplace_back(name);
      continue;
    }
    const auto first = static_cast<std::ptrdiff_t>(files.size());
    for (const auto& entry : fs::directory_iterator(name)) {
      if (entry.is_regular_file()) files.push_back(entry.path());
    }
    std::sort(files.begin() + first, files.end());
  }
  return files;
}

std::vector<Descriptor> describe_image(OrbExtractor& orb, const fs::path& file) {
  const HeaderRead header = read_image_header(file);
  ImageRead read;
  if (header.problem.empty()) read = read_color_image(file, header.header.size);
  const std::string problem = header.problem + read.problem;
  if (!problem.empty()) throw Error(problem, file.string(), "give 8-bit PNG or JPEG images");
  cv::Mat gray;
  cv::cvtColor(read.image, gray, cv::COLOR_BGR2GRAY);
  const Features features = orb.extract(gray);
  return {features.descriptors.begin(), features.descriptors.end()};
}

void train(const TrainArguments& arguments) {
  const auto files = image_files(arguments.images);
  OrbExtractor orb(arguments.orb);
  std::vector<std::vector<Descriptor>> images;
  images.reserve(files.size());
  for (const fs::path& file : files) images.push_back(describe_image(orb, file));
  const Vocabulary vocabulary = train_vocabulary(images, arguments.options);
  const std::string bytes = vocabulary.bytes();
  write_file(arguments.out, bytes);
  fmt::print("written: {} ({} words of {} images, {} levels, {:.2f} MB)\n", arguments.out,
             vocabulary.words(), images.size(), vocabulary.depth(),
             static_cast<double>(bytes.size()) / 1e6);
}

}  // namespace

void add_vocabulary_command(CLI::App& app) {
  auto arguments = std::make_shared<TrainArguments>();
  CLI::App* command = app.add_subcommand(
      "vocabulary", "train the visual words of place recognition: feature/vocabulary.bin");
  command->add_option("images", arguments->images, "image files, or folders of them")
      ->required()
      ->check(CLI::ExistingPath);
  command->add_option("--out", arguments->out, "file to write")->capture_default_str();
  command->add_option("--branching", arguments->options.branching, "number of children of a node")
      ->capture_default_str();
  command
      ->add_option("--depth", arguments->options.depth,
                   "levels of the tree; there are branching^depth words at most")
      ->capture_default_str();
  command->add_option("--seed", arguments->options.seed, "seed of the clustering")
      ->capture_default_str();
  command->add_option("--keypoints", arguments->orb.keypoints, "keypoints per image")
      ->capture_default_str();
  command->callback([arguments] { train(*arguments); });
}

}  // namespace stillmap::lab
