// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/mover_error.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <filesystem>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr int kFrames = 40;
double stamp(int frame) { return frame / 30.0; }

/// Returns an object that moves along x at 0.6 m/s and starts at `x` [m].
MoverPosition object_at(int frame, int id, double x, double z = 3) {
  MoverPosition p;
  p.timestamp = stamp(frame);
  p.id = id;
  p.class_name = "person";
  p.centroid = {x + 0.6 * stamp(frame), 0, z};
  p.velocity = {0.6, 0, 0};
  p.pixels = 5000;
  return p;
}

MoverErrors compare(const std::vector<MoverPosition>& truth,
                    const std::vector<MoverPosition>& estimate, const Pose& T = Pose()) {
  return compare_movers(truth, estimate, T, 0, stamp(kFrames));
}

TEST(MoverErrors, MeasuresPositionAndVelocityInTheTruthsWorld) {
  const Pose T_truth_estimate(so3_exp({0.1, 0.7, -0.3}), {4, 5, 6});
  std::vector<MoverPosition> truth, estimate;
  for (int i = 0; i < kFrames; ++i) {
    truth.push_back(object_at(i, 1, 0));
    MoverPosition e = truth.back();
    e.id = 7;
    e.centroid += Eigen::Vector3d(0, 0.03, 0.04);
    e.velocity += Eigen::Vector3d(0.1, 0, 0);
    e.centroid = T_truth_estimate.inverse() * e.centroid;
    e.velocity = T_truth_estimate.quaternion().conjugate() * e.velocity;
    estimate.push_back(e);
  }
  const MoverErrors errors = compare(truth, estimate, T_truth_estimate);
  EXPECT_NEAR(errors.position.median, 0.05, 1e-9);
  EXPECT_NEAR(errors.position_ground.median, 0.03, 1e-9) << "along the truth's x and y";
  EXPECT_NEAR(errors.velocity.median, 0.1, 1e-9);
  EXPECT_EQ(errors.matches, static_cast<std::size_t>(kFrames));
  EXPECT_EQ(errors.misses + errors.false_positives + errors.switches + errors.false_tracks, 0U);
  EXPECT_EQ(errors.class_share, 1);
  EXPECT_EQ(errors.mota, 1);
  EXPECT_EQ(errors.idf1, 1);
}

TEST(MoverErrors, CountsSwitchesMissesAndFalseTracks) {
  std::vector<MoverPosition> truth, estimate;
  for (int i = 0; i < kFrames; ++i) {
    truth.push_back(object_at(i, 1, 0));
    truth.push_back(object_at(i, 2, 0, 5));
    estimate.push_back(object_at(i, i < 20 ? 1 : 2, 0));  // Two objects swap their ids,
    if (i >= 10) estimate.push_back(object_at(i, i < 20 ? 2 : 1, 0, 5));  // one is found late,
    if (i >= 35) estimate.push_back(object_at(i, 3, -9));  // and one estimate is false.
  }
  const MoverErrors errors = compare(truth, estimate);
  EXPECT_EQ(errors.switches, 2U);
  EXPECT_EQ(errors.misses, 10U);
  EXPECT_EQ(errors.false_positives, 5U);
  EXPECT_EQ(errors.false_tracks, 1U);
  EXPECT_NEAR(errors.mota, 1 - 17.0 / 80, 1e-12);
}

TEST(MoverErrors, OccludedAndRestingObjectsAreNeitherMissedNorFalse) {
  std::vector<MoverPosition> truth, estimate;
  for (int i = 0; i < kFrames; ++i) {
    truth.push_back(object_at(i, 1, 0));
    truth.back().pixels = 10;
    truth.push_back(object_at(i, 2, 2));
    truth.back().velocity.setZero();
    if (i < 20) estimate.push_back(object_at(i, 1, 0));
    if (i >= 20) estimate.push_back(object_at(i, 2, 2));
  }
  const MoverErrors errors = compare(truth, estimate);
  EXPECT_EQ(errors.positions, 0U);
  EXPECT_EQ(errors.misses + errors.false_positives + errors.false_tracks, 0U);
}

TEST(MoverErrors, AnEstimateInsideTheBoxMatchesTheObject) {
  MoverPosition truth = object_at(0, 1, 0), estimate = object_at(0, 1, 0);
  estimate.centroid.y() -= 0.7;  // a head
  EXPECT_EQ(compare({truth}, {estimate}).matches, 0U);
  truth.box = {truth.centroid - Eigen::Vector3d(0.3, 0.9, 0.3),
               truth.centroid + Eigen::Vector3d(0.3, 0.9, 0.3)};
  EXPECT_EQ(compare({truth}, {estimate}).matches, 1U);
}

class MoverFile : public ::testing::Test {
 protected:
  ~MoverFile() override { std::filesystem::remove(file_); }
  std::filesystem::path file_ = test::own_path("movers.csv");
};

TEST_F(MoverFile, ColumnsAreFoundByTheirNames) {
  write_file(file_,
             "# a comment\nid,class,state,timestamp,x,y,z,vx,vy,vz\n"
             "4,dog,predicted,1.5,1,2,3,0.1,0.2,0.3\n");
  const auto movers = read_movers(file_);
  ASSERT_EQ(movers.size(), 1U);
  EXPECT_EQ(movers[0].id, 4);
  EXPECT_EQ(movers[0].class_name, "dog");
  EXPECT_FALSE(movers[0].observed);
  EXPECT_EQ(movers[0].timestamp, 1.5);
  EXPECT_EQ(movers[0].centroid, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(movers[0].velocity, Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_TRUE(movers[0].box.isEmpty());
}

TEST_F(MoverFile, AMalformedTableIsAnError) {
  write_file(file_, "");
  EXPECT_THROW(read_movers(file_), Error);
  write_file(file_, "timestamp,id,class,x,y,z\n");
  EXPECT_THROW(read_movers(file_), Error);
  write_file(file_, "timestamp,id,class,x,y,z,vx,vy,vz\n1,1,person,1,2,3,4,5\n");
  EXPECT_THROW(read_movers(file_), Error);
  write_file(file_, "timestamp,id,class,x,y,z,vx,vy,vz\n1,1,person,1,2,nan,4,5,6\n");
  EXPECT_THROW(read_movers(file_), Error);
  write_file(file_, "timestamp,id,class,x,y,z,vx,vy,vz\n1,1e300,person,1,2,3,4,5,6\n");
  EXPECT_THROW(read_movers(file_), Error);
  write_file(file_, "timestamp,id,class,x,y,z,vx,vy,vz,min_x,max_x\n1,1,person,1,2,3,4,5,6,7,8\n");
  EXPECT_THROW(read_movers(file_), Error) << "two of the six columns of a box";
}

}  // namespace
}  // namespace stillmap
