// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <numbers>

namespace stillmap::simulate {

/// Hashes 64 bits: the finalizer of SplitMix64 (Steele, Lea and Flood 2014, Fast splittable
/// pseudorandom number generators, section 4).
constexpr std::uint64_t scramble(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ull;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

/// A small seeded generator. Unlike the distributions of the standard library, these do not depend
/// on the implementation, so a seed gives the same scene with every compiler.
class Random {
 public:
  explicit Random(std::uint64_t seed, std::uint64_t stream = 0)
      : state_(scramble(seed) ^ scramble(~stream)) {}

  std::uint64_t bits() { return scramble(state_ += 0x9e3779b97f4a7c15ull); }
  /// Uniform in [0, 1).
  double uniform() { return static_cast<double>(bits() >> 11) * 0x1p-53; }
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  float real(double low, double high) { return static_cast<float>(uniform(low, high)); }
  /// Uniform in [low, high], both included.
  int integer(int low, int high) {
    return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1));
  }
  bool chance(double probability) { return uniform() < probability; }
  /// Standard normal (Box and Muller 1958).
  double normal() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(2 * std::numbers::pi * uniform());
  }
  template <typename Container>
  const auto& pick(const Container& from) {
    return from[static_cast<std::size_t>(bits() % std::size(from))];
  }

 private:
  std::uint64_t state_;
};

}  // namespace stillmap::simulate
