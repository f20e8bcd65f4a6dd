// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/tum_writer.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

SimulationOptions tiny() {
  SimulationOptions options;
  options.width = 96;
  options.height = 72;
  options.frames = 3;
  options.people = 1;
  options.things = 1;
  return options;
}

class TumWriter : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = test::own_path("tum_writer");
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  fs::path folder_;
};

TEST_F(TumWriter, RefusesAFolderWithFilesOfItsUser) {
  fs::create_directories(folder_);
  write_file(folder_ / "rgb.txt", "mine");
  EXPECT_THROW(write_tum_layout(SimulatedSequence(tiny()), folder_), Error);
  EXPECT_EQ(read_file(folder_ / "rgb.txt"), "mine");
}

TEST_F(TumWriter, ReplacesAnEarlierSequenceAsAWhole) {
  write_tum_layout(SimulatedSequence(tiny()), folder_);
  SimulationOptions shorter = tiny();
  shorter.frames = 1;
  write_file(folder_ / "depth" / "notes.txt", "mine");
  write_tum_layout(SimulatedSequence(shorter), folder_);
  const fs::directory_iterator images(folder_ / "rgb");
  EXPECT_EQ(std::distance(fs::begin(images), fs::end(images)), 1);
  EXPECT_EQ(read_file(folder_ / "depth" / "notes.txt"), "mine");
}

TEST_F(TumWriter, AnInterruptedSequenceIsWholeUpToItsEnd) {
  const SimulatedSequence sequence(tiny());
  EXPECT_EQ(write_tum_layout(sequence, folder_, [](std::size_t done) { return done < 2; }), 2u);
  EXPECT_EQ(read_trajectory(folder_ / "groundtruth.txt").size(), 2u);
  const std::string list = read_file(folder_ / "associations.txt");
  EXPECT_EQ(std::count(list.begin(), list.end(), '\n'), 2);
  EXPECT_TRUE(fs::exists(folder_ / "camera.yaml"));
}

TEST_F(TumWriter, FilesEqualTheSequence) {
  const SimulatedSequence sequence(tiny());
  std::vector<std::size_t> steps;
  write_tum_layout(sequence, folder_, [&](std::size_t done) {
    steps.push_back(done);
    return true;
  });
  EXPECT_EQ(steps, (std::vector<std::size_t>{1, 2, 3}));

  const SimulatedFrame made = sequence.at(2);
  const std::string file = "0.066667.png";
  const cv::Mat color = read_stored_image(folder_ / "rgb" / file).image,
                mask = read_stored_image(folder_ / "mask" / file).image;
  const cv::Mat depth = read_stored_image(folder_ / "depth" / file).image;
  EXPECT_EQ(cv::norm(color, made.frame->color, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(mask, class_mask(made.truth), cv::NORM_INF), 0);
  const cv::Mat instances = read_stored_image(folder_ / "instance" / file).image;
  EXPECT_EQ(cv::norm(instances, made.truth.instances, cv::NORM_INF), 0);
  cv::Mat speed = read_stored_image(folder_ / "speed" / file).image;
  speed.convertTo(speed, CV_32F, 0.005);
  EXPECT_LE(cv::norm(speed, cv::min(sequence.speed(2), 1.275), cv::NORM_INF), 0.00251);
  ASSERT_EQ(depth.type(), CV_16UC1);
  cv::Mat meters;
  depth.convertTo(meters, CV_32F, 1 / 5000.0);
  EXPECT_LT(cv::norm(meters, made.frame->depth, cv::NORM_INF), 0.00011);

  const Trajectory truth = read_trajectory(folder_ / "groundtruth.txt");
  ASSERT_EQ(truth.size(), 3U);
  EXPECT_LT((truth[2].T_world_camera.inverse() * sequence.T_world_camera(2)).log().norm(), 1e-7);
  EXPECT_DOUBLE_EQ(read_camera(folder_ / "camera.yaml").fx, sequence.camera().fx);
  EXPECT_EQ(read_camera(folder_ / "camera.yaml").depth_sensor.name, "kinect_v1");
}

TEST_F(TumWriter, ListsNameEveryFrame) {
  write_tum_layout(SimulatedSequence(tiny()), folder_);
  const auto lines = [&](const char* name) {
    const std::string text = read_file(folder_ / name);
    return std::count(text.begin(), text.end(), '\n');
  };
  EXPECT_EQ(lines("rgb.txt"), 2 + 3);
  EXPECT_EQ(lines("depth.txt"), 2 + 3);
  EXPECT_EQ(lines("associations.txt"), 3);
  EXPECT_EQ(lines("truth_movers.csv"), 1 + 3 * 2);
  EXPECT_NE(read_file(folder_ / "associations.txt")
                .find("0.033333 rgb/0.033333.png 0.033333 depth/0.033333.png"),
            std::string::npos);
}

TEST_F(TumWriter, CornersOfTagsAreWrittenAndThoseOfAnEarlierSequenceRemoved) {
  SimulationOptions options = tiny();
  options.frames = 1;
  options.tags = 2;
  const SimulatedSequence sequence(options);
  write_tum_layout(sequence, folder_);
  std::ifstream file(folder_ / "tags.csv");
  std::string header;
  std::getline(file, header);
  EXPECT_EQ(header, "id,x0,y0,z0,x1,y1,z1,x2,y2,z2,x3,y3,z3");
  std::size_t lines = 0;
  for (std::string line; std::getline(file, line); ++lines) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::size_t id = 0;
    fields >> id;
    EXPECT_EQ(id, lines);
    ASSERT_LT(id, 2U);
    for (const Eigen::Vector3d& corner : sequence.scene().tags[id].corners) {
      Eigen::Vector3d p;
      fields >> p.x() >> p.y() >> p.z();
      EXPECT_LT((p - corner).norm(), 1e-6);
    }
    EXPECT_TRUE(fields);
  }
  EXPECT_EQ(lines, 2U);
  options.tags = 0;
  write_tum_layout(SimulatedSequence(options), folder_);
  EXPECT_FALSE(fs::exists(folder_ / "tags.csv"));
}

TEST_F(TumWriter, AFolderThatCannotBeCreatedIsAnError) {
  std::ofstream(folder_) << "a file, not a folder";
  EXPECT_THROW(write_tum_layout(SimulatedSequence(tiny()), folder_), Error);
}

}  // namespace
}  // namespace stillmap
