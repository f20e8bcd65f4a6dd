// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/bundle_adjustment.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/optimize/bundle_solver.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

namespace stillmap {
namespace {

bool finite(const Pose& pose) {
  return pose.translation().allFinite() && pose.quaternion().coeffs().allFinite();
}

void require(bool ok, const std::string& what, const std::string& where, const std::string& fix) {
  if (!ok) throw Error(what, where, fix);
}

void validate(const BundleProblem& problem) {
  const std::size_t poses = problem.T_world_camera.size(), points = problem.points.size();
  require(problem.pose_fixed.size() == poses, "needs one flag per pose",
          "BundleProblem::pose_fixed", "make it as long as T_world_camera");
  require(problem.point_fixed.empty() || problem.point_fixed.size() == points,
          "needs one flag per point, or none", "BundleProblem::point_fixed",
          "make it as long as points, or leave it empty");
  require(std::ranges::all_of(problem.T_world_camera, finite), "a pose is not finite",
          "BundleProblem::T_world_camera", "remove this keyframe");
  require(std::ranges::all_of(problem.observations,
                              [&](const auto& o) { return o.pose < poses && o.point < points; }),
          "an index is out of range", "BundleProblem::observations",
          "use indices into T_world_camera and points");
  require(std::ranges::any_of(problem.pose_fixed, [](auto fixed) { return fixed != 0; }),
          "no pose is fixed, so the world frame is undetermined", "BundleProblem::pose_fixed",
          "fix at least one keyframe");
}

/// Returns the stable order of the observations by point, then pose.
std::vector<std::uint32_t> order_by_point(const std::vector<BundleObservation>& observations) {
  std::vector<std::uint32_t> order(observations.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](std::uint32_t i) {
    return std::uint64_t{observations[i].point} << 32 | observations[i].pose;
  });
  return order;
}

BundleModel make_model(const BundleProblem& problem) {
  BundleModel model;
  model.camera = problem.camera;
  model.pose_free.assign(problem.T_world_camera.size(), 0);
  model.point_free.assign(problem.points.size(), 0);
  model.terms.reserve(problem.observations.size());
  for (const std::uint32_t i : order_by_point(problem.observations)) {
    const BundleObservation& o = problem.observations[i];
    const ObservationNoise noise = observation_noise(problem.camera, o.depth);
    const Measurement m = make_measurement(problem.camera, noise, o.u, o.v, o.depth, o.scale);
    const bool usable = m.usable() && o.weight > 0 && std::isfinite(o.weight) &&
                        is_plausible_point(problem.points[o.point]);
    if (!usable) continue;
    model.terms.push_back({o.pose, o.point, i, m, o.weight, {true, m.has_depth()}});
    model.pose_free[o.pose] = problem.pose_fixed[o.pose] == 0;
    model.point_free[o.point] = problem.point_fixed.empty() || problem.point_fixed[o.point] == 0;
  }
  return model;
}

BundleState make_state(const BundleProblem& problem) {
  BundleState state;
  state.T_camera_world.reserve(problem.T_world_camera.size());
  for (const Pose& pose : problem.T_world_camera) state.T_camera_world.push_back(pose.inverse());
  state.points = problem.points;
  return state;
}

/// Excludes outliers from the next pass.
void classify(const BundleState& state, BundleModel& model) {
  for (BundleTerm& term : model.terms) {
    term.parts = inlier_parts(model.camera, term.measurement,
                              state.T_camera_world[term.pose] * state.points[term.point],
                              kPixelChi2, kDisparityChi2);
  }
}

/// Returns the cost of all observations including outliers, comparable before and after.
double robust_cost(BundleModel model, const BundleState& state, const Kernels& kernels) {
  for (BundleTerm& term : model.terms) term.parts = {true, term.measurement.has_depth()};
  return bundle_cost(model, state, kernels);
}

void write(const BundleProblem& problem, const BundleModel& model, BundleState&& state,
           BundleResult& result) {
  result.T_world_camera = problem.T_world_camera;
  for (std::size_t i = 0; i < model.pose_free.size(); ++i) {
    if (model.pose_free[i]) result.T_world_camera[i] = state.T_camera_world[i].inverse();
  }
  result.points = std::move(state.points);
  result.pixel_outlier.assign(problem.observations.size(), 1);
  result.depth_outlier.assign(problem.observations.size(), 0);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    const float depth = problem.observations[i].depth;
    result.depth_outlier[i] = std::isfinite(depth) && depth > 0;
  }
  for (const BundleTerm& term : model.terms) {
    result.pixel_outlier[term.observation] = !term.parts.pixel;
    if (term.parts.disparity) result.depth_outlier[term.observation] = 0;
  }
}

}  // namespace

double bundle_cost(const BundleModel& model, const BundleState& state, const Kernels& kernels) {
  double sum = 0;
  for (const BundleTerm& term : model.terms) {
    sum += observation_cost(model.camera, term.measurement, term.parts, term.weight, kernels,
                            state.T_camera_world[term.pose] * state.points[term.point]);
  }
  return 0.5 * sum;
}

BundleResult adjust_bundle_with(BundleMinimizer minimize, const BundleProblem& problem,
                                const BundleLimits& limits, const StopRequest& stop) {
  const TraceScope scope("solve");
  validate(problem);
  Stopwatch watch;
  BundleResult result;
  BundleModel model = make_model(problem);
  BundleState state = make_state(problem);
  const auto run = [&](const Kernels& kernels, int iterations) {
    const PassSummary pass =
        minimize(model, {kernels, iterations, limits.cost_tolerance}, stop, state);
    classify(state, model);
    result.iterations += pass.iterations;
    result.interrupted = pass.interrupted;
  };
  const Kernels robust{{kPixelChi2}, {kDisparityChi2}, true};
  const Kernels plain{{kPixelChi2}, {kDisparityChi2}, false};
  result.cost_before = robust_cost(model, state, robust);
  result.setup_ms = watch.lap();
  run(robust, limits.robust_iterations);
  result.robust_ms = watch.lap();
  if (!result.interrupted) run(plain, limits.plain_iterations);
  result.cost_after = robust_cost(model, state, robust);
  write(problem, model, std::move(state), result);
  result.plain_ms = watch.lap();
  return result;
}

BundleResult adjust_bundle(const BundleProblem& problem, const StopRequest& stop) {
  return adjust_bundle_with(minimize_with_schur, problem, {}, stop);
}

}  // namespace stillmap
