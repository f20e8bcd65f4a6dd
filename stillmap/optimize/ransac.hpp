// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <random>
#include <vector>

namespace stillmap {

/// Maximum number of samples.
inline constexpr int kMaxSamples = 500;
/// Probability of at least one sample without outliers at which sampling stops [0..1].
inline constexpr double kRansacConfidence = 0.999;

/// Model with the most inliers.
template <typename Model>
struct Consensus {
  Model model;
  std::vector<std::uint8_t> inlier;  ///< One per datum.
  int inliers = 0;
  int iterations = 0;  ///< Number of samples drawn.
};

namespace ransac_detail {

/// Returns `Size` different indices below `count`. Avoids std::uniform_int_distribution, whose
/// numbers depend on the standard library.
template <std::size_t Size>
std::array<std::size_t, Size> draw(std::size_t count, std::mt19937_64& random) {
  std::array<std::size_t, Size> sample{};
  for (std::size_t i = 0; i < Size;) {
    sample[i] = random() % count;
    const auto end = sample.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::find(sample.begin(), end, sample[i]) == end) ++i;
  }
  return sample;
}

/// Returns the number of samples needed to draw one without outliers with kRansacConfidence
/// (Fischler and Bolles 1981).
inline double samples_needed(double inlier_share, std::size_t size) {
  const double good = std::pow(inlier_share, static_cast<double>(size));
  if (good >= 1) return 1;
  if (good <= 0) return 1e12;
  return std::log(1 - kRansacConfidence) / std::log1p(-good);
}

}  // namespace ransac_detail

/// Random sample consensus (Fischler and Bolles, CACM 1981), with a fixed seed and an
/// adaptive number of samples. Returns nothing if no model has `min_inliers`.
/// @param count    number of data
/// @param propose  sample of `Size` indices -> models that fit it, std::vector<Model>
/// @param judge    model -> inlier flag per datum, std::vector<std::uint8_t>
template <std::size_t Size, typename Model, typename Propose, typename Judge>
std::optional<Consensus<Model>> ransac(std::size_t count, int min_inliers, Propose&& propose,
                                       Judge&& judge) {
  if (count < Size || count < static_cast<std::size_t>(min_inliers)) return std::nullopt;
  std::mt19937_64 random(1);
  std::optional<Consensus<Model>> best;
  double wanted = kMaxSamples;
  int drawn = 0;
  for (; drawn < wanted; ++drawn) {
    for (const Model& model : propose(ransac_detail::draw<Size>(count, random))) {
      std::vector<std::uint8_t> inlier = judge(model);
      const auto inliers = static_cast<int>(std::count(inlier.begin(), inlier.end(), 1));
      if (inliers < min_inliers || (best && inliers <= best->inliers)) continue;
      best = Consensus<Model>{model, std::move(inlier), inliers, 0};
      wanted = std::min<double>(
          kMaxSamples, ransac_detail::samples_needed(
                           static_cast<double>(inliers) / static_cast<double>(count), Size));
    }
  }
  if (best) best->iterations = drawn;
  return best;
}

}  // namespace stillmap
