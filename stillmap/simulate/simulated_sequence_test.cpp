// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/simulated_sequence.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cmath>
#include <malloc.h>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/features2d.hpp>

namespace stillmap {
namespace {

SimulationOptions small(const std::string& camera = "xyz") {
  SimulationOptions options;
  options.camera = camera;
  options.width = 320;
  options.height = 240;
  options.frames = 90;
  options.people = 2;
  options.noise = false;
  return options;
}

double difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

/// Returns the largest difference of depth among the four pixels around (u, v).
bool smooth_at(const cv::Mat& depth, double u, double v, double most) {
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  double low = 100, high = 0;
  for (const auto& [dx, dy] : {std::pair{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
    const double z = depth.at<float>(y + dy, x + dx);
    low = std::min(low, z);
    high = std::max(high, z);
  }
  return low > 0 && high - low < most;
}

/// Interpolates between the four pixels around (u, v), in inverse depth, which is linear on a
/// plane.
double inverse_depth_at(const cv::Mat& depth, double u, double v) {
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const double a = u - x, b = v - y;
  const auto w = [&](int dx, int dy) { return 1.0 / depth.at<float>(y + dy, x + dx); };
  return (1 - b) * ((1 - a) * w(0, 0) + a * w(1, 0)) + b * ((1 - a) * w(0, 1) + a * w(1, 1));
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

TEST(SimulatedSequence, StaticPointsKeepTheirPositionAndColor) {
  const SimulatedSequence sequence(small());
  const SimulatedFrame a = sequence.at(0), b = sequence.at(45);
  const Camera& camera = sequence.camera();
  const Pose T_b_a = b.truth.T_world_camera.inverse() * a.truth.T_world_camera;
  ASSERT_GT(T_b_a.translation().norm(), 0.1);
  int compared = 0, same_depth = 0;
  std::vector<double> depth_errors, color_errors;
  for (int v = 2; v < camera.height - 2; v += 3) {
    for (int u = 2; u < camera.width - 2; u += 3) {
      if (a.truth.instances.at<std::uint8_t>(v, u) != 0 || !smooth_at(a.truth.depth, u, v, 0.03))
        continue;
      const Eigen::Vector3d p = T_b_a * camera.unproject(u, v, a.truth.depth.at<float>(v, u));
      const Eigen::Vector2d q = camera.project(p);
      if (p.z() <= 0 || !camera.contains(q.x(), q.y(), 2)) continue;
      if (!smooth_at(b.truth.depth, q.x(), q.y(), 0.03)) continue;
      const int x = static_cast<int>(std::lround(q.x())), y = static_cast<int>(std::lround(q.y()));
      const double z = 1 / inverse_depth_at(b.truth.depth, q.x(), q.y());
      if (z < p.z() - 0.03 || b.truth.instances.at<std::uint8_t>(y, x) != 0) continue;  // hidden
      ++compared;
      same_depth += std::abs(z - p.z()) < 0.002;
      depth_errors.push_back(std::abs(z - p.z()));
      color_errors.push_back(
          std::abs(a.frame->gray.at<std::uint8_t>(v, u) - b.frame->gray.at<std::uint8_t>(y, x)));
    }
  }
  ASSERT_GT(compared, 2000);
  EXPECT_GT(same_depth, 0.97 * compared);  // The rest are creases between the four pixels.
  EXPECT_LT(median(depth_errors),
            2e-5);                      // Most points lie on planes, where interpolation is exact.
  EXPECT_LT(median(color_errors), 10);  // Color of the nearest pixel, up to half a pixel away.
}

TEST(SimulatedSequence, EqualOptionsGiveEqualBytesOnAnyNumberOfThreads) {
  SimulationOptions options = small();
  options.noise = true;
  options.things = 1;
  options.threads = 1;
  const SimulatedFrame one = SimulatedSequence(options).at(7);
  options.threads = 3;
  const SimulatedFrame other = SimulatedSequence(options).at(7);
  EXPECT_EQ(difference(one.frame->color, other.frame->color), 0);
  EXPECT_EQ(difference(one.frame->depth, other.frame->depth), 0);
  EXPECT_EQ(difference(one.truth.instances, other.truth.instances), 0);
  options.seed = 2;
  EXPECT_GT(difference(one.frame->color, SimulatedSequence(options).at(7).frame->color), 50);
}

/// Returns the texels of a scene that is made while new memory is filled with a byte.
std::vector<std::uint32_t> texels_with(int byte) {
  mallopt(M_PERTURB, byte);
  const Scene scene = make_scene({.people = 2});
  mallopt(M_PERTURB, 0);
  std::vector<std::uint32_t> texels;
  for (const auto& texture : scene.textures) {
    const auto& finest = texture.levels().front().texels;
    texels.insert(texels.end(), finest.begin(), finest.end());
  }
  return texels;
}

TEST(SimulatedSequence, TexturesDoNotDependOnWhatWasInMemory) {
  const auto texels = texels_with(30);
  EXPECT_GT(texels.size(), 1'000'000U);
  EXPECT_EQ(texels, texels_with(200));
}

TEST(SimulatedSequence, TruthMatchesTheFrame) {
  const SimulatedSequence sequence(small());
  const SimulatedFrame made = sequence.at(11);
  const TruthFrame truth = sequence.truth(11);
  EXPECT_EQ(difference(made.truth.depth, truth.depth), 0);
  EXPECT_EQ(difference(made.truth.instances, truth.instances), 0);
  EXPECT_EQ(difference(made.frame->depth, truth.depth), 0);  // Noise is disabled.
  EXPECT_EQ(truth.timestamp, made.frame->timestamp);
}

TEST(SimulatedSequence, ItsCameraHasTheSensorThatIsNamed) {
  SimulationOptions options = small();
  options.noise = true;
  options.sensor = "ideal";
  const SimulatedFrame exact = SimulatedSequence(options).at(3);
  EXPECT_EQ(difference(exact.frame->depth, exact.truth.depth), 0);
  options.sensor = "realsense_d455";
  const SimulatedSequence stereo(options);
  EXPECT_EQ(stereo.camera().depth_sensor.name, "realsense_d455");
  EXPECT_EQ(stereo.camera().baseline, 0.095);
  options.sensor = "realsense";
  EXPECT_THROW(SimulatedSequence{options}, Error);
}

TEST(SimulatedSequence, ARollingShutterShowsEachRowAtItsOwnTime) {
  SimulationOptions options = small("rpy");
  options.people = 0;
  options.readout = 1 / 30.0;
  options.speed = 2;
  const SimulatedSequence rolling(options);
  options.readout = 0;
  options.fps = 240;  // eight frames for each of the other sequence
  const SimulatedSequence global(options, [&] {
    Camera camera = rolling.camera();
    camera.fps = options.fps;
    return camera;
  }());
  const std::size_t index = 20;
  const cv::Mat shown = rolling.at(index).truth.depth;
  for (const int quarter : {-1, 1}) {
    const int row = 120 + quarter * 60;  // read a quarter of the readout before or after the middle
    const auto shift = static_cast<std::size_t>(8 * static_cast<int>(index) + 2 * quarter);
    const cv::Mat then = global.truth(shift).depth, middle = global.truth(8 * index).depth;
    std::vector<double> errors, changes;
    for (int u = 0; u < 320; ++u) {
      errors.push_back(std::abs(shown.at<float>(row, u) - then.at<float>(row, u)));
      changes.push_back(std::abs(middle.at<float>(row, u) - then.at<float>(row, u)));
    }
    EXPECT_GT(median(changes), 0.002);
    EXPECT_LT(median(errors), 0.15 * median(changes));  // the rest: half a row, uneven motion
  }
}

TEST(SimulatedSequence, DelayedDepthIsThatOfALaterTime) {
  SimulationOptions options = small();
  options.depth_delay = 1 / options.fps;
  const SimulatedSequence delayed(options);
  const SimulatedFrame frame = delayed.at(30);
  EXPECT_EQ(difference(frame.frame->depth, delayed.truth(31).depth), 0);
  EXPECT_EQ(difference(frame.truth.depth, delayed.truth(30).depth), 0);
}

TEST(SimulatedSequence, NextGivesEveryFrameOnce) {
  SimulationOptions options = small();
  options.width = 80;
  options.height = 60;
  options.frames = 3;
  SimulatedSequence sequence(options);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(sequence.size(), 3 - i);
    const RgbdFramePtr frame = sequence.next();
    ASSERT_NE(frame, nullptr);
    EXPECT_EQ(frame->index, i);
    EXPECT_DOUBLE_EQ(frame->timestamp, static_cast<double>(i) / 30);
    EXPECT_EQ(frame->color.type(), CV_8UC3);
    EXPECT_EQ(frame->gray.size(), cv::Size(80, 60));
    EXPECT_EQ(frame->depth.type(), CV_32FC1);
  }
  EXPECT_EQ(sequence.next(), nullptr);
  sequence.rewind();
  EXPECT_NE(sequence.next(), nullptr);
}

TEST(SimulatedSequence, MoversAreInFrontOfTheRoom) {
  SimulationOptions options = small();
  options.activity = "mixed";
  options.people = 3;
  options.things = 3;
  const SimulatedSequence with(options);
  options.people = options.things = 0;
  const SimulatedSequence without(options);
  int moving = 0, people = 0, things = 0;
  for (const std::size_t i : {0U, 40U, 80U}) {
    const TruthFrame a = with.truth(i), b = without.truth(i);
    const cv::Mat mask = class_mask(a);
    for (int v = 0; v < mask.rows; ++v) {
      for (int u = 0; u < mask.cols; ++u) {
        const float near = a.depth.at<float>(v, u), far = b.depth.at<float>(v, u);
        const bool mover = a.instances.at<std::uint8_t>(v, u) != 0;
        ASSERT_EQ(near < far, mover) << u << ' ' << v;
        if (!mover) {
          ASSERT_EQ(near, far);
        }
        moving += mover;
        people += mask.at<std::uint8_t>(v, u) == 255;
        things += mask.at<std::uint8_t>(v, u) == 128;
      }
    }
  }
  EXPECT_EQ(people + things, moving);
  EXPECT_GT(people, 3 * 320 * 240 / 50);  // At least 2 % of the image.
  EXPECT_GT(things, 3 * 320 * 240 / 100);
}

TEST(SimulatedSequence, MoverTruthMatchesTheImages) {
  SimulationOptions options = small();
  options.things = 3;
  const SimulatedSequence sequence(options);
  for (const std::size_t i : {5U, 50U}) {
    const TruthFrame truth = sequence.truth(i);
    ASSERT_EQ(truth.movers.size(), 5U);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) {
        const int id = truth.instances.at<std::uint8_t>(v, u);
        if (id == 0) continue;
        const MoverTruth& mover = truth.movers[static_cast<std::size_t>(id - 1)];
        const Eigen::Vector3d p =
            truth.T_world_camera * sequence.camera().unproject(u, v, truth.depth.at<float>(v, u));
        ASSERT_LT(mover.box.exteriorDistance(p), 1e-4) << mover.name;
      }
    }
    const auto before = sequence.movers(i - 1), after = sequence.movers(i + 1);
    for (std::size_t k = 0; k < truth.movers.size(); ++k) {
      const Eigen::Vector3d expected = 15 * (after[k].centroid - before[k].centroid);
      EXPECT_LT((truth.movers[k].velocity - expected).norm(), 0.08) << truth.movers[k].name;
    }
  }
}

TEST(SimulatedSequence, WalkersStayOnTheFloorAndApart) {
  SimulationOptions options = small();
  options.people = 4;
  options.frames = 600;
  const SimulatedSequence sequence(options);
  for (std::size_t i = 0; i < 600; i += 7) {
    const auto movers = sequence.movers(i);
    for (const MoverTruth& m : movers) {
      ASSERT_NEAR(m.box.min().z(), 0, 0.035) << i;
      ASSERT_NEAR(m.box.max().z(), 1.75, 0.15) << i;
      ASSERT_NEAR(m.velocity.head<2>().norm(), 0.8, 0.25) << i;
      for (const MoverTruth& other : movers) {
        if (other.id == m.id) continue;
        ASSERT_GT((other.centroid - m.centroid).norm(), 0.8) << i;
      }
    }
  }
}

struct MotionCase {
  const char* name;
  double speed, turn;  // Mean speeds of TUM's fr3 walking sequences [m/s, deg/s].
};
class CameraMotions : public testing::TestWithParam<MotionCase> {};

TEST_P(CameraMotions, HaveTumSpeedsAndStayInFreeSpace) {
  SimulationOptions options = small(GetParam().name);
  options.people = 0;
  options.width = 64;
  options.height = 48;
  options.frames = 900;
  const SimulatedSequence sequence(options);
  double way = 0, turned = 0;
  for (std::size_t i = 1; i < sequence.frames(); ++i) {
    const Pose step = sequence.T_world_camera(i - 1).inverse() * sequence.T_world_camera(i);
    way += step.translation().norm();
    turned += step.angle() * 180 / std::numbers::pi;
    if (i % 15 != 0) continue;
    const TruthFrame truth = sequence.truth(i);
    double nearest = 0;
    cv::minMaxLoc(truth.depth, &nearest);
    // Also: no pixel shows the outside of the room, where depth is 0.
    ASSERT_GT(nearest, 0.3) << i;
    ASSERT_TRUE(sequence.scene().room.contains(truth.T_world_camera.translation()));
  }
  const double seconds = static_cast<double>(sequence.frames() - 1) / options.fps;
  EXPECT_GT(way / seconds, 0.5 * GetParam().speed);
  EXPECT_LT(way / seconds, 2.0 * GetParam().speed);
  EXPECT_GT(turned / seconds, 0.5 * GetParam().turn);
  EXPECT_LT(turned / seconds, 2.0 * GetParam().turn);
}
INSTANTIATE_TEST_SUITE_P(SimulatedSequence, CameraMotions,
                         testing::Values(MotionCase{"static", 0.012, 1.388},
                                         MotionCase{"xyz", 0.208, 5.490},
                                         MotionCase{"halfsphere", 0.221, 18.267},
                                         MotionCase{"rpy", 0.091, 20.903}),
                         [](const auto& motion) { return std::string(motion.param.name); });

TEST(CameraMotion, HandShakeHasTheWantedAmplitude) {
  Scene empty;
  empty.viewpoint = {{0, 0, 1}, {1, 0, 1}};
  const CameraMotionOptions options{
      .motion = "static", .shake_position = 0.002, .shake_rotation = 0.004};
  const CameraMotion motion(options, empty);
  const Pose home = look_at({0, 0, 1}, {1, 0, 1});
  Eigen::Vector3d shift = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
  constexpr int kSamples = 6000;
  for (int i = 0; i < kSamples; ++i) {
    const Pose shake = home.inverse() * motion.T_world_camera(i * 0.05);
    shift += shake.translation().cwiseAbs2() / kSamples;
    turn += so3_log(shake.quaternion()).cwiseAbs2() / kSamples;
  }
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(std::sqrt(shift[axis]), 0.002, 0.0002);
    EXPECT_NEAR(std::sqrt(turn[axis]), 0.004, 0.0004);
  }
  const CameraMotion steady({.motion = "static", .shake_position = 0, .shake_rotation = 0}, empty);
  EXPECT_LT((home.inverse() * steady.T_world_camera(3.3)).log().norm(), 1e-9);
}

TEST(SimulatedSequence, EveryViewHasCornersEverywhere) {
  SimulationOptions options;
  options.people = 2;
  const SimulatedSequence first(options);
  for (const char* camera : {"static", "xyz", "halfsphere", "rpy"}) {
    options.camera = camera;
    const SimulatedSequence sequence(options, first.camera(), first.shared_scene());
    for (const std::size_t i : {30U, 200U}) {
      const SimulatedFrame made = sequence.at(i);
      std::vector<cv::KeyPoint> corners;
      cv::FAST(made.frame->gray, corners, 20);
      cv::Mat cells = cv::Mat::zeros(6, 8, CV_32SC1);
      for (const auto& corner : corners) {
        const cv::Point p(corner.pt);
        if (made.truth.instances.at<std::uint8_t>(p) == 0) ++cells.at<int>(p.y / 80, p.x / 80);
      }
      EXPECT_GT(cv::sum(cells)[0], 1000) << camera << ' ' << i;
      EXPECT_GT(cv::countNonZero(cells >= 4), 40) << camera << ' ' << i;  // of 48
    }
  }
}

TEST(SimulatedSequence, MovingPeopleHaveCorners) {
  SimulationOptions options;
  options.people = 2;
  const SimulatedSequence sequence(options);
  int corners_on_people = 0, pixels = 0;
  for (const std::size_t i : {0U, 100U, 200U}) {
    const SimulatedFrame made = sequence.at(i);
    std::vector<cv::KeyPoint> corners;
    cv::FAST(made.frame->gray, corners, 20);
    for (const auto& corner : corners)
      corners_on_people += made.truth.instances.at<std::uint8_t>(corner.pt) != 0;
    pixels += cv::countNonZero(made.truth.instances);
  }
  EXPECT_GT(corners_on_people, pixels / 200);  // As dense as 1500 corners in the whole image.
}

TEST(SimulatedSequence, MotionBlurAveragesTheExposure) {
  SimulationOptions options = small("rpy");
  const SimulatedSequence sharp(options);
  options.exposures = 5;
  options.exposure_time = 0.03;
  const SimulatedSequence blurred(options, sharp.camera(), sharp.shared_scene());
  const auto corners = [](const SimulatedSequence& sequence) {
    std::vector<cv::KeyPoint> found;
    cv::FAST(sequence.frame(20)->gray, found, 20);
    return found.size();
  };
  EXPECT_LT(corners(blurred), corners(sharp));
  EXPECT_EQ(difference(blurred.truth(20).depth, sharp.truth(20).depth), 0);
}

TEST(SimulatedSequence, EveningIsDarkerAndLitFromElsewhere) {
  SimulationOptions options = small();
  const SimulatedFrame day = SimulatedSequence(options).at(0);
  options.light = "evening";
  const SimulatedFrame evening = SimulatedSequence(options).at(0);
  EXPECT_EQ(difference(day.truth.depth, evening.truth.depth), 0);
  cv::Mat bright, dark;
  day.frame->gray.convertTo(bright, CV_32F);
  evening.frame->gray.convertTo(dark, CV_32F);
  const cv::Mat ratio = dark / bright;
  EXPECT_LT(cv::mean(ratio)[0], 0.8);
  // No factor on the whole image, as another exposure would be, turns one into the other.
  cv::Scalar mean, deviation;
  cv::meanStdDev(ratio, mean, deviation);
  EXPECT_GT(deviation[0], 0.05);
}

TEST(SimulatedSequence, OptionsOutOfRangeAreErrors) {
  const auto make = [](auto change) {
    SimulationOptions options;
    change(options);
    SimulatedSequence sequence(options);
  };
  using O = SimulationOptions;
  EXPECT_THROW(make([](O& o) { o.scene = "cellar"; }), Error);
  EXPECT_THROW(make([](O& o) { o.camera = "spin"; }), Error);
  EXPECT_THROW(make([](O& o) { o.activity = "fly"; }), Error);
  EXPECT_THROW(make([](O& o) { o.light = "dawn"; }), Error);
  EXPECT_THROW(make([](O& o) { o.people = -1; }), Error);
  EXPECT_THROW(make([](O& o) { o.people = 7; }), Error);
  EXPECT_THROW(make([](O& o) { o.things = 4; }), Error);
  EXPECT_THROW(make([](O& o) { o.frames = 0; }), Error);
  EXPECT_THROW(make([](O& o) { o.width = 0; }), Error);
  EXPECT_THROW(make([](O& o) { o.fps = 0; }), Error);
  EXPECT_THROW(make([](O& o) { o.exposures = 0; }), Error);
  EXPECT_THROW(make([](O& o) { o.threads = 0; }), Error);
}

}  // namespace
}  // namespace stillmap
