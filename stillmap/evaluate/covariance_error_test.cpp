// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/covariance_error.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using testing::HasSubstr;

/// Trajectory whose errors are drawn from known covariances.
struct DisturbedRun {
  Trajectory truth, estimate;
  std::vector<StampedCovariance> covariances;
  std::vector<UncertainPose> poses;
};

/// @param factor  the standard deviations that are told, as a multiple of the true ones
DisturbedRun disturbed_run(double factor) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  DisturbedRun run;
  for (int i = 0; i < 2000; ++i) {
    const double time = 0.03 * i;
    const Pose T(so3_exp({0.2 * std::sin(time), 0.1 * time, 0.3}), {std::cos(time), time, 1});
    Matrix6d L = Matrix6d::Zero();
    L.diagonal() << 0.002, 0.003, 0.004, 0.001, 0.002, 0.0015;
    L(5, 0) = 0.001;
    Vector6d noise;
    for (double& value : noise) value = normal(random);
    const Vector6d e = L * noise;
    run.truth.push_back({time, T});
    // The true pose is the estimate times exp(e).
    run.estimate.push_back({time, T * Pose::exp(e).inverse()});
    run.covariances.push_back({time, factor * factor * L * L.transpose()});
    run.poses.push_back(
        {time, run.estimate.back().T_world_camera, run.covariances.back().covariance});
  }
  return run;
}

CovarianceFigures figures_of(const DisturbedRun& run) {
  return covariance_figures(run.truth, run.estimate, run.covariances);
}

TEST(CovarianceFigures, AreThoseOfAChiSquareDistributionForErrorsFromTheCovariances) {
  const CovarianceFigures figures = figures_of(disturbed_run(1));
  EXPECT_EQ(figures.poses, 2000U);
  EXPECT_NEAR(figures.nees, 6, 0.3);  // standard deviation of the mean: sqrt(12 / 2000) = 0.08
  EXPECT_NEAR(figures.nees_translation, 3, 0.2);
  EXPECT_NEAR(figures.nees_rotation, 3, 0.2);
  EXPECT_NEAR(figures.share_within_95, 0.95, 0.02);
  EXPECT_NEAR(figures.translation_rmse / figures.translation_sigma, 1, 0.03);
  EXPECT_NEAR(figures.rotation_rmse / figures.rotation_sigma, 1, 0.03);
}

TEST(CovarianceFigures, ShowStandardDeviationsThatAreHalfTheTrueOnes) {
  const CovarianceFigures figures = figures_of(disturbed_run(0.5));
  EXPECT_NEAR(figures.nees, 24, 1.2);
  EXPECT_LT(figures.share_within_95, 0.3);
  EXPECT_NEAR(figures.translation_rmse / figures.translation_sigma, 2, 0.06);
}

TEST(CovarianceFigures, DoNotDependOnTheWorldOfTheEstimate) {
  DisturbedRun run = disturbed_run(1);
  const Pose T(so3_exp({0.3, -0.5, 1.1}), {4, -2, 1});
  const double before = figures_of(run).nees;
  for (auto& [stamp, pose] : run.estimate) pose = T * pose;
  EXPECT_NEAR(figures_of(run).nees, before, 1e-6);
}

TEST(CovarianceFigures, LeaveOutPosesWithoutACovariance) {
  DisturbedRun run = disturbed_run(1);
  run.covariances.front().covariance.setZero();
  run.covariances.pop_back();
  EXPECT_EQ(figures_of(run).poses, 1998U);
  for (auto& entry : run.covariances) entry.timestamp += 0.01;
  EXPECT_THROW(figures_of(run), Error);
}

class CovarianceFile : public testing::Test {
 protected:
  void SetUp() override { std::filesystem::create_directories(folder_); }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string problem_of(const std::string& text) {
    write_file(file_, text);
    try {
      read_covariances(file_);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_ = test::own_path("covariances");
  std::filesystem::path file_ = folder_ / "trajectory_covariance.txt";
};

TEST_F(CovarianceFile, IsReadAsWritten) {
  const DisturbedRun run = disturbed_run(1);
  write_covariances(file_, run.poses);
  const auto read = read_covariances(file_);
  ASSERT_EQ(read.size(), run.covariances.size());
  for (std::size_t i = 0; i < read.size(); ++i)
    EXPECT_TRUE(read[i].covariance.isApprox(run.covariances[i].covariance, 1e-5)) << i;
}

TEST_F(CovarianceFile, AnInvalidLineIsNamed) {
  EXPECT_THAT(problem_of("# nothing\n"), HasSubstr("contains no covariance"));
  EXPECT_THAT(problem_of("# title\n0.1 1 2 3\n"), HasSubstr("trajectory_covariance.txt:2"));
  std::string nan = "0.1";
  for (int i = 0; i < 21; ++i) nan += " nan";
  EXPECT_THAT(problem_of(nan + "\n"), HasSubstr("21 numbers"));
}

}  // namespace
}  // namespace stillmap
