// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/ceres_bundle.hpp"
#include "stillmap/optimize/synthetic.hpp"

#include <benchmark/benchmark.h>

namespace stillmap {
namespace {

void solve_pose_benchmark(benchmark::State& state) {
  const auto scene =
      synthetic::pose_scene(1, static_cast<int>(state.range(0)), {1.0, 0.3, 0.1, 0.1, 0.2});
  std::mt19937 rng(2);
  const Pose guess = scene.T_world_camera * synthetic::random_pose(rng, 0.02, 0.01);
  int iterations = 0;
  for (auto _ : state) {
    const PoseSolution solution = solve_pose(scene.camera, guess, scene.observations);
    iterations = solution.iterations;
    benchmark::DoNotOptimize(solution.rms);
  }
  state.counters["iterations"] = iterations;
}
BENCHMARK(solve_pose_benchmark)->Arg(200)->Arg(1000)->Unit(benchmark::kMicrosecond);

void adjust_bundle_benchmark(benchmark::State& state) {
  synthetic::BundleShape shape;
  shape.free_poses = static_cast<int>(state.range(0));
  shape.points = static_cast<int>(state.range(1));
  if (shape.free_poses > 50) shape.fixed_poses = 1, shape.spacing = 0.1;  // A whole map.
  const auto scene = synthetic::bundle_scene(1, shape, {1.0, 0.3, 0.05, 0.05, 0.2});
  const BundleMinimizer minimize =
      state.range(2) != 0 ? ceres_bundle::minimize : minimize_with_schur;
  BundleResult result;
  for (auto _ : state) result = adjust_bundle_with(minimize, scene.problem, {});
  state.counters["iterations"] = result.iterations;
  state.counters["cost"] = result.cost_after;
  state.counters["observations"] = static_cast<double>(scene.problem.observations.size());
  state.counters["setup_ms"] = result.setup_ms;
  state.counters["robust_ms"] = result.robust_ms;
  state.counters["plain_ms"] = result.plain_ms;
}
BENCHMARK(adjust_bundle_benchmark)
    ->ArgNames({"poses", "points", "ceres"})
    ->Args({15, 2500, 0})
    ->Args({15, 2500, 1})
    ->Args({200, 10000, 0})
    ->Args({200, 10000, 1})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace stillmap
