#include "stillmap/evaluate/benchmark_sequences.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

/// Makes the lists of a recording without images.
void make_recording(const fs::path& folder, bool with_truth = true) {
  fs::create_directories(folder);
  write_file(folder / "rgb.txt", "");
  write_file(folder / "depth.txt", "");
  if (with_truth) write_file(folder / "groundtruth.txt", "");
}

std::vector<std::string> names_of(const std::vector<BenchmarkSequence>& sequences) {
  std::vector<std::string> names;
  for (const auto& sequence : sequences) names.push_back(sequence.name);
  return names;
}

using Names = std::vector<std::string>;

TEST(BenchmarkName, AcceptsTheBenchmarksNameAndShortForms) {
  for (const char* folder : {"rgbd_dataset_freiburg3_walking_halfsphere", "fr3_walking_halfsphere",
                             "freiburg3_w_half", "w_half", "walking_halfsphere"}) {
    EXPECT_EQ(benchmark_name(folder), "walking_halfsphere") << folder;
  }
  EXPECT_EQ(benchmark_name("fr3_s_static"), "sitting_static");
  EXPECT_EQ(benchmark_name("rgbd_dataset_freiburg1_rpy"), "fr1_rpy");
  EXPECT_EQ(benchmark_name("rgbd_bonn_crowd"), "bonn_crowd");
  EXPECT_EQ(benchmark_name("kitchen_walking_xyz"), "kitchen_walking_xyz");
}

TEST(BenchmarkName, IsEmptyForOtherRecordings) {
  for (const char* folder : {"rgbd_dataset_freiburg3_walking_xyz_validation", "fr3_office",
                             "rgbd_dataset_freiburg1_xyz", "walking", "images"}) {
    EXPECT_EQ(benchmark_name(folder), "") << folder;
  }
}

TEST(BenchmarkSequences, AreThePapersFirstWithCameraAndTruthFrame) {
  const fs::path data = test::own_path("benchmark_sequences");
  for (const char* name :
       {"kitchen_still", "rgbd_bonn_crowd", "fr1_rpy", "fr3_s_xyz", "fr3_w_xyz", "my_recording"})
    make_recording(data / name);
  make_recording(data / "fr3_w_rpy", false);
  const auto found = find_benchmark_sequences(data);
  EXPECT_EQ(names_of(found),
            (Names{"walking_xyz", "sitting_xyz", "bonn_crowd", "fr1_rpy", "kitchen_still"}));
  EXPECT_EQ(found[0].camera, "tum_fr3");
  EXPECT_EQ(found[2].truth_frame, "bonn");
  EXPECT_EQ(found[3].camera, "tum_fr1");
  EXPECT_EQ(found[4].camera, "");
}

TEST(BenchmarkSequences, CameraFileOfTheRecordingTakesPrecedence) {
  const fs::path data = test::own_path("benchmark_camera");
  make_recording(data / "fr3_w_xyz");
  write_file(data / "fr3_w_xyz" / "camera.yaml", "");
  EXPECT_EQ(find_benchmark_sequences(data).at(0).camera, "");
}

TEST(BenchmarkSequences, CanBeNamedWhetherKnownOrNot) {
  const fs::path data = test::own_path("benchmark_named");
  make_recording(data / "my_recording");
  make_recording(data / "fr3_w_xyz");
  EXPECT_EQ(names_of(find_benchmark_sequences(data, {"my_recording", "walking_xyz"})),
            (Names{"my_recording", "walking_xyz"}));
  const std::string error = test::error_of([&] { find_benchmark_sequences(data, {"walking_xy"}); });
  EXPECT_NE(error.find("walking_xyz"), std::string::npos) << error;
}

TEST(DownloadHint, NamesTheSequenceAndItsPage) {
  const std::string hint = download_hint("walking_rpy");
  EXPECT_NE(hint.find("rgbd_dataset_freiburg3_walking_rpy"), std::string::npos);
  EXPECT_NE(hint.find("https://"), std::string::npos);
}

}  // namespace
}  // namespace stillmap
