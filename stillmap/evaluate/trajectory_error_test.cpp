// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/trajectory_error.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"

#include <cmath>
#include <filesystem>
#include <numbers>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using test::error_of;
using Json = nlohmann::json;

// The digits below come from golden/make_golden.py: an evaluation of its own, written with numpy
// from the rules.
class Golden : public ::testing::TestWithParam<const char*> {
 protected:
  const std::filesystem::path folder_ = STILLMAP_EVALUATE_GOLDEN;
  const std::string name_ = GetParam();
  const Trajectory truth_ = read_trajectory(folder_ / (name_ + "_truth.txt"));
  const Trajectory estimate_ = read_trajectory(folder_ / (name_ + "_estimate.txt"));
  const Json expected_ = Json::parse(read_file(folder_ / "expected.json")).at(name_);

  static void expect_equal(const Statistics& actual, const Json& expected, double tolerance,
                           double tolerance_of_min) {
    EXPECT_EQ(actual.count, expected.at("count").get<std::size_t>());
    EXPECT_NEAR(actual.rmse, expected.at("rmse").get<double>(), tolerance);
    EXPECT_NEAR(actual.mean, expected.at("mean").get<double>(), tolerance);
    EXPECT_NEAR(actual.median, expected.at("median").get<double>(), tolerance);
    EXPECT_NEAR(actual.sd, expected.at("sd").get<double>(), tolerance);
    EXPECT_NEAR(actual.max, expected.at("max").get<double>(), tolerance);
    EXPECT_NEAR(actual.min, expected.at("min").get<double>(), tolerance_of_min);
  }

  static void expect_equal(const RpeResult& actual, const Json& expected) {
    const Json& pairs = expected.at("pairs");
    ASSERT_EQ(actual.pairs.size(), pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      EXPECT_EQ(actual.pairs[i].timestamp, pairs[i][0].get<double>()) << "pair " << i;
      EXPECT_EQ(actual.pairs[i].end_timestamp, pairs[i][1].get<double>()) << "pair " << i;
    }
    expect_equal(actual.translation, expected.at("translation"), 1e-11, 1e-11);
    // arccos turns the last bit of a trace near 3 into about 1e-6 degrees.
    expect_equal(actual.rotation, expected.at("rotation"), 2e-8, 3e-6);
  }
};

TEST_P(Golden, AbsoluteTrajectoryError) {
  const AteResult ate = absolute_trajectory_error(truth_, estimate_);
  const Json& expected = expected_.at("ate");
  const Json& matches = expected.at("matches");
  ASSERT_EQ(ate.pairs.size(), matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(ate.pairs[i].truth_timestamp, matches[i][0].get<double>()) << "pair " << i;
    EXPECT_EQ(ate.pairs[i].timestamp, matches[i][1].get<double>()) << "pair " << i;
  }
  expect_equal(ate.translation, expected.at("translation"), 1e-11, 1e-11);
  const Eigen::Matrix3d R = ate.T_truth_estimate.rotation();
  for (int row = 0; row < 3; ++row) {
    EXPECT_NEAR(ate.T_truth_estimate.translation()(row),
                expected.at("t_truth_estimate")[row].get<double>(), 1e-9);
    for (int column = 0; column < 3; ++column) {
      EXPECT_NEAR(R(row, column), expected.at("R_truth_estimate")[row][column].get<double>(), 1e-9);
    }
  }
}

TEST_P(Golden, RelativePoseErrorOverOneSecond) {
  expect_equal(relative_pose_error(truth_, estimate_), expected_.at("rpe_1s"));
}

TEST_P(Golden, RelativePoseErrorPerFrame) {
  expect_equal(relative_pose_error(truth_, estimate_, RpeDelta::kFrame), expected_.at("rpe_frame"));
}

INSTANTIATE_TEST_SUITE_P(Cases, Golden, ::testing::Values("drift", "ties", "holes", "mirrored"),
                         [](const auto& test) { return std::string(test.param); });

TEST(GoldenSet, HoldsACaseWhereAReflectionWouldFitBest) {
  const auto file = std::filesystem::path(STILLMAP_EVALUATE_GOLDEN) / "expected.json";
  EXPECT_TRUE(Json::parse(read_file(file)).at("mirrored").at("ate").at("reflection_guarded"));
}

Trajectory line(double start, double step, int count) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double s = step * i;
    trajectory.push_back({start + s, Pose(so3_exp({0, 0.1 * s, 0}), {s, s * s, std::sin(s)})});
  }
  return trajectory;
}

Trajectory seen_from(const Pose& T_new_world, Trajectory trajectory) {
  for (StampedPose& pose : trajectory) pose.T_world_camera = T_new_world * pose.T_world_camera;
  return trajectory;
}

TEST(AbsoluteTrajectoryError, IsZeroInAnotherWorldAndFindsTheAlignment) {
  const Trajectory truth = line(10, 0.1, 40);
  const Pose T_truth_estimate(so3_exp({0.3, -2, 0.4}), {5, -6, 7});
  const AteResult ate =
      absolute_trajectory_error(truth, seen_from(T_truth_estimate.inverse(), truth));
  EXPECT_LT(ate.translation.max, 1e-12);
  EXPECT_LT((ate.T_truth_estimate.inverse() * T_truth_estimate).log().norm(), 1e-12);
}

TEST(AbsoluteTrajectoryError, DoesNotForgiveAWrongScale) {
  const Trajectory truth = line(0, 0.1, 40);
  Trajectory estimate = truth;
  for (StampedPose& pose : estimate) {
    pose.T_world_camera =
        Pose(pose.T_world_camera.quaternion(), 1.1 * pose.T_world_camera.translation());
  }
  EXPECT_GT(absolute_trajectory_error(truth, estimate).translation.rmse, 0.1);
}

TEST(AbsoluteTrajectoryError, ASimilarityFindsTheScale) {
  const Trajectory truth = line(0, 0.1, 40);
  Trajectory estimate = seen_from(Pose(so3_exp({0.3, -2, 0.4}), {5, -6, 7}), truth);
  for (StampedPose& pose : estimate) {
    pose.T_world_camera =
        Pose(pose.T_world_camera.quaternion(), 0.8 * pose.T_world_camera.translation());
  }
  const Evaluation evaluation = evaluate_trajectory(truth, estimate, {.with_scale = true});
  EXPECT_NEAR(evaluation.ate_with_scale->scale, 1.25, 1e-9);
  EXPECT_LT(evaluation.ate_with_scale->translation.max, 1e-9);
  EXPECT_EQ(evaluation.ate.scale, 1);
  EXPECT_GT(evaluation.ate.translation.rmse, 0.05);
  EXPECT_NEAR(Json(evaluation).at("ate_with_scale").at("scale").get<double>(), 1.25, 1e-9);
}

TEST(DisplacementError, MeasuresASingleJumpAndNotTheDriftAfterIt) {
  const Trajectory truth = line(0, 0.1, 40);
  Trajectory estimate = truth;
  for (std::size_t i = 20; i < estimate.size(); ++i) {
    estimate[i].T_world_camera =
        Pose(estimate[i].T_world_camera.quaternion(),
             estimate[i].T_world_camera.translation() + Eigen::Vector3d(0, 2, 0));
  }
  const DisplacementResult result = displacement_error(truth, estimate, Pose());
  EXPECT_EQ(result.error.count, 39u);
  EXPECT_NEAR(result.error.max, 2, 1e-12);
  EXPECT_NEAR(result.error.mean, 2.0 / 39, 1e-12);
  EXPECT_EQ(result.largest_step_at, estimate[20].timestamp);
}

TEST(DisplacementError, PassesOverLostFramesAndInterpolatesTheTruth) {
  // The truth moves evenly, so that interpolation at other timestamps is exact.
  Trajectory truth, estimate;
  for (int i = 0; i <= 100; ++i) truth.push_back({0.04 * i, Pose(so3_exp({}), {0.01 * i, 0, 0})});
  for (int i = 0; i < 100; ++i) {
    if (i >= 40 && i < 60) continue;
    const double t = 0.033 * i + 0.013;
    estimate.push_back({t, Pose(so3_exp({}), {0.25 * t, 0, 0})});
  }
  const DisplacementResult result = displacement_error(truth, estimate, Pose());
  EXPECT_EQ(result.error.count, 78u);
  EXPECT_LT(result.error.max, 1e-12);
}

TEST(AbsoluteTrajectoryError, SaysWhyThereIsNone) {
  const Trajectory truth = line(10, 0.1, 40);
  const std::string apart =
      error_of([&] { absolute_trajectory_error(truth, line(1000, 0.1, 40)); });
  EXPECT_NE(apart.find("do not overlap in time"), std::string::npos) << apart;
  EXPECT_NE(apart.find("10.000000 to 13.900000"), std::string::npos) << apart;
  EXPECT_NE(apart.find("1000.000000 to 1003.900000"), std::string::npos) << apart;

  const std::string few = error_of([&] { absolute_trajectory_error(truth, line(10.05, 0.1, 40)); });
  EXPECT_NE(few.find("only 0 pairs"), std::string::npos) << few;
  EXPECT_NE(
      error_of([&] { absolute_trajectory_error(truth, line(10, 0.1, 2)); }).find("only 2 pairs"),
      std::string::npos);
  EXPECT_NE(error_of([&] { absolute_trajectory_error(truth, {}); }).find("estimated trajectory"),
            std::string::npos);
}

TEST(RelativePoseError, MeasuresDriftPerSecond) {
  const double degrees_per_second = 0.5, meters_per_second = 0.02;
  Trajectory truth, estimate;
  for (int i = 0; i <= 100; ++i) {
    const double t = 0.1 * i;
    truth.push_back({t, Pose()});
    const double angle = t * degrees_per_second * std::numbers::pi / 180;
    estimate.push_back({t, Pose(so3_exp({0, 0, angle}), {0, 0, t * meters_per_second})});
  }
  const RpeResult rpe = relative_pose_error(truth, estimate);
  EXPECT_EQ(rpe.pairs.size(), 90u);  // the pose at 9 s would need the last one
  EXPECT_NEAR(rpe.translation.max, meters_per_second, 1e-12);
  EXPECT_NEAR(rpe.translation.min, meters_per_second, 1e-12);
  EXPECT_NEAR(rpe.rotation.median, degrees_per_second, 1e-9);
}

TEST(RelativePoseError, SaysWhyThereIsNone) {
  EXPECT_NE(error_of([] {
              relative_pose_error(line(0, 0.1, 40), line(0, 0.1, 1));
            }).find("estimated trajectory: has 1 pose,"),
            std::string::npos);
  EXPECT_NE(error_of([] {
              relative_pose_error(line(0, 0.1, 40), line(100, 0.1, 40));
            }).find("no two poses 1 s apart"),
            std::string::npos);
}

TEST(AbsoluteTrajectoryError, NothingIsAlignedWhereTheWorldsAreKnown) {
  const Trajectory truth = line(10, 0.1, 40);
  const Pose T_estimate_truth(so3_exp({0, 0, 0}), {0, 0.03, 0});
  const Trajectory estimate = seen_from(T_estimate_truth, truth);
  const auto rmse = [&](const Pose& T_truth_estimate) {
    const AteOptions options{.T_truth_estimate = T_truth_estimate};
    return absolute_trajectory_error(truth, estimate, options).translation.rmse;
  };
  EXPECT_NEAR(rmse(Pose()), 0.03, 1e-12);
  EXPECT_NEAR(rmse(T_estimate_truth.inverse()), 0, 1e-12);
}

TEST(EvaluationReport, ARecordingShorterThanASecondHasAnAbsoluteErrorOnly) {
  const Trajectory truth = line(10, 0.1, 9);
  const Evaluation evaluation = evaluate_trajectory(truth, truth);
  EXPECT_EQ(evaluation.ate.pairs.size(), 9u);
  EXPECT_TRUE(evaluation.rpe.pairs.empty());
  EXPECT_TRUE(Json(evaluation).at("rpe_1s").is_null());
  const std::string text = evaluation_text(evaluation);
  EXPECT_NE(text.find("ATE [m]"), std::string::npos) << text;
  EXPECT_NE(text.find("none: no two poses are that far apart"), std::string::npos) << text;
}

TEST(EvaluationReport, FitsIntoEightyColumns) {
  Trajectory truth = line(10, 0.1, 30), estimate = truth;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const double error = i % 2 == 0 ? 1234.5 : 0;
    estimate[i].T_world_camera =
        Pose(Eigen::Quaterniond(i % 3 == 0 ? 0 : 1, i % 3 == 0 ? 1 : 0, 0, 0), {error, 0, 0});
  }
  const std::string text = evaluation_text(evaluate_trajectory(truth, estimate));
  EXPECT_NE(text.find("180.0000 "), std::string::npos) << text;
  std::istringstream lines(text.substr(0, text.find("largest step")));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 78u) << line;
}

TEST(Coverage, CountsDistinctStampsAgainstTheSequence) {
  Trajectory estimate = line(0, 0.1, 30);
  estimate.push_back(estimate.back());
  const Coverage coverage = compute_coverage(estimate, 40);
  EXPECT_EQ(coverage.tracked, 30u);
  EXPECT_DOUBLE_EQ(coverage.share(), 0.75);
  EXPECT_FALSE(coverage.estimated);
}

TEST(Coverage, IsReckonedFromTheTruthWhereTheLengthIsUnknown) {
  Trajectory estimate = line(0, 0.1, 101);
  estimate.erase(estimate.begin() + 20, estimate.begin() + 45);
  const Coverage coverage = estimate_coverage(estimate, line(0, 0.01, 1001));
  EXPECT_EQ(coverage.tracked, 76u);
  EXPECT_EQ(coverage.total, 101u);
  EXPECT_TRUE(coverage.estimated);
}

TEST(EvaluationReport, GivesTheSameFiguresAsTextAndAsJson) {
  const Trajectory truth = line(0, 0.1, 40);
  const Evaluation evaluation =
      evaluate_trajectory(truth, seen_from(Pose::exp({1, 2, 3, 0.1, 0.2, 0.3}), truth),
                          {.total_frames = 50, .per_frame = true});
  const Json json = evaluation;
  EXPECT_EQ(json.at("ate").at("pairs"), 40);
  EXPECT_NEAR(json.at("ate").at("translation_m").at("rmse").get<double>(), 0, 1e-12);
  EXPECT_EQ(json.at("rpe_frame").at("pairs"), 38);
  EXPECT_DOUBLE_EQ(json.at("coverage").at("share").get<double>(), 0.8);
  const std::string text = evaluation_text(evaluation);
  EXPECT_NE(text.find("ATE [m]"), std::string::npos);
  EXPECT_NE(text.find("coverage 40/50 frames = 80.0 %"), std::string::npos) << text;
}

TEST(Evaluation, OfATruthWithoutRotationsHasNoRelativeErrors) {
  Trajectory truth, estimate;
  for (int i = 0; i < 60; ++i) {
    const double t = i / 30.0;
    truth.push_back({t, Pose(Eigen::Quaterniond::Identity(), {t, std::sin(t), t * t})});
    estimate.push_back(
        {t, Pose(so3_exp({0, 0.01 * t, 0}), truth.back().T_world_camera.translation())});
  }
  const Evaluation evaluation = evaluate_trajectory(truth, estimate, {});
  EXPECT_TRUE(evaluation.only_positions) << "the camera turns by one degree only";
  EXPECT_LT(evaluation.ate.translation.rmse, 1e-6);
  EXPECT_TRUE(evaluation.rpe.pairs.empty());
}

}  // namespace
}  // namespace stillmap
