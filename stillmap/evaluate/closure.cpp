// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/closure.hpp"

#include "stillmap/base/error.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

}  // namespace

double ClosureError::space_percent() const { return percent(space, path); }
double ClosureError::plane_percent() const { return percent(plane, path_in_plane); }

ClosureError closure_error(const AteResult& ate) {
  if (ate.pairs.size() < 2) {
    throw Error("fewer than two poses have true ones", "closure error",
                "compare a trajectory with the truth of the same recording");
  }
  const AtePair &first = ate.pairs.front(), &last = ate.pairs.back();
  const Eigen::Vector3d error =
      (last.p_estimate - first.p_estimate) - (last.p_truth - first.p_truth);
  ClosureError closure;
  closure.space = error.norm();
  closure.plane = error.head<2>().norm();
  for (std::size_t i = 1; i < ate.pairs.size(); ++i) {
    const Eigen::Vector3d step = ate.pairs[i].p_truth - ate.pairs[i - 1].p_truth;
    closure.path += step.norm();
    closure.path_in_plane += step.head<2>().norm();
  }
  return closure;
}

std::string closure_text(const ClosureError& error, bool planar) {
  std::string text = fmt::format("closure error in space   {:.4f} m, {:.3f} % of {:.2f} m\n",
                                 error.space, error.space_percent(), error.path);
  if (planar) {
    text += fmt::format("closure error in plane   {:.4f} m, {:.3f} % of {:.2f} m\n", error.plane,
                        error.plane_percent(), error.path_in_plane);
  }
  return text;
}

void to_json(nlohmann::json& json, const ClosureError& error) {
  json = {{"space_m", error.space}, {"space_percent", error.space_percent()},
          {"plane_m", error.plane}, {"plane_percent", error.plane_percent()},
          {"path_m", error.path},   {"path_in_plane_m", error.path_in_plane}};
}

}  // namespace stillmap
