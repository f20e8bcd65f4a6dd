// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/stamp_unit.hpp"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns stamps at 30 Hz that begin at a time [s], in a unit [s].
std::vector<double> stamps(double begin, double unit) {
  std::vector<double> stamps;
  for (int i = 0; i < 9; ++i) stamps.push_back((begin + i / 30.0) / unit);
  return stamps;
}

TEST(StampUnit, FollowsFromTimesSince1970) {
  for (const double unit : {1.0, 1e-3, 1e-6, 1e-9})
    EXPECT_EQ(unit_of_stamps(stamps(1305031229.5, unit)), unit);
}

TEST(StampUnit, StampsOfARecordingsOwnClockAreSeconds) {
  EXPECT_EQ(unit_of_stamps(stamps(0, 1)), 1);
  EXPECT_EQ(unit_of_stamps(stamps(86400, 1)), 1);
  // Nanoseconds since the start of a computer, 50 minutes ago, are no milliseconds since 1970.
  EXPECT_EQ(unit_of_stamps(stamps(3000, 1e-9)), 1);
}

TEST(StampUnit, OneStampOrNoneIsEnough) {
  EXPECT_EQ(unit_of_stamps({}), 1);
  EXPECT_EQ(unit_of_stamps(std::vector{1305031229500.0}), 1e-3);
  EXPECT_EQ(unit_of_stamps(std::vector{std::numeric_limits<double>::quiet_NaN()}), 1);
}

}  // namespace
}  // namespace stillmap
