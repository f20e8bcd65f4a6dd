// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <numeric>

namespace stillmap {
namespace {

/// Maximum number of known names that a message lists; of more, it lists the nearest.
constexpr std::size_t kMostListed = 16, kNearestListed = 5;

std::size_t edit_distance(const std::string& a, const std::string& b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] != b[j - 1]);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

/// Returns the edit distance; 1 for a name of which at least 3 characters are given.
std::size_t distance(const std::string& given, const std::string& name) {
  constexpr std::size_t kLeast = 3;
  const std::size_t edits = edit_distance(given, name);
  return given.size() >= kLeast && name.starts_with(given) ? std::min<std::size_t>(edits, 1)
                                                           : edits;
}

}  // namespace

std::string nearest_name(const std::string& name, const std::vector<std::string>& known) {
  return *std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return distance(name, a) < distance(name, b);
  });
}

std::string suggestion(const std::string& name, const std::vector<std::string>& known) {
  std::vector<std::string> nearest = known;
  std::stable_sort(nearest.begin(), nearest.end(), [&](const auto& a, const auto& b) {
    return distance(name, a) < distance(name, b);
  });
  std::string text;
  if (!nearest.empty() && distance(name, nearest.front()) <= 1 + name.size() / 3) {
    text = "did you mean '" + nearest.front() + "'? ";
  }
  const bool all = known.size() <= kMostListed;
  if (!all) nearest.resize(kNearestListed);
  const std::vector<std::string>& listed = all ? known : nearest;
  text += all ? "Known: " : "The nearest are: ";
  for (std::size_t i = 0; i < listed.size(); ++i) text += (i ? ", " : "") + listed[i];
  return text;
}

}  // namespace stillmap
