// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/number.hpp"

#include "stillmap/base/test_locale.hpp"

#include <cmath>
#include <cstdlib>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(NumberOf, ReadsDecimalNumbers) {
  EXPECT_EQ(number_of("1305031102.175304"), 1305031102.175304);
  EXPECT_EQ(number_of("-2.5e-3"), -0.0025);
  EXPECT_EQ(number_of("+.5"), 0.5);
  EXPECT_EQ(number_of(" 7"), 7);
}

TEST(NumberOf, ReadsWhatIsNotFinite) {
  EXPECT_TRUE(std::isnan(number_of("nan").value()));
  EXPECT_TRUE(std::isinf(number_of("-inf").value()));
  EXPECT_TRUE(std::isinf(number_of("1e999").value()));
}

TEST(NumberOf, RefusesAllElse) {
  for (const char* text : {"", " ", "x", "1,5", "1.5m", "--1", "+"})
    EXPECT_FALSE(number_of(text)) << text;
}

TEST(NumberOf, DoesNotDependOnTheLocale) {
  const test::DecimalCommas commas;
  if (!commas.is_set()) GTEST_SKIP() << "this machine has no sources of locales";
  ASSERT_EQ(std::strtod("1.5", nullptr), 1);  // the locale is in force
  EXPECT_EQ(number_of("1.5"), 1.5);
  EXPECT_FALSE(number_of("1,5"));
}

TEST(LeadingNumber, LeavesTheRest) {
  const auto number = leading_number("12.5 no pose");
  ASSERT_TRUE(number);
  EXPECT_EQ(number->value, 12.5);
  EXPECT_EQ(number->rest, " no pose");
}

}  // namespace
}  // namespace stillmap
