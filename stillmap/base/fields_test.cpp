// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/fields.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

struct Inner {
  double threshold = 0.5;
  STILLMAP_FIELDS(threshold)
};
struct Outer {
  int count = 3;
  Inner inner;
  std::string name = "x";
  STILLMAP_FIELDS(count, inner, name)
};

TEST(Fields, VisitsEachFieldOnceInOrder) {
  Outer outer;
  std::vector<std::string> names;
  for_each_field(outer, [&](const char* name, auto&) { names.emplace_back(name); });
  EXPECT_EQ(names, (std::vector<std::string>{"count", "inner", "name"}));
}

TEST(Fields, KnowsNestedOptionsFromValues) {
  static_assert(HasFields<Outer> && HasFields<Inner>);
  static_assert(!HasFields<int> && !HasFields<std::string>);
  Outer outer;
  for_each_field(outer, [](const char*, auto& member) {
    if constexpr (std::is_same_v<std::decay_t<decltype(member)>, int>) member = 7;
  });
  EXPECT_EQ(outer.count, 7);
}

}  // namespace
}  // namespace stillmap
