// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/counted.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Counted, OneIsSingular) {
  EXPECT_EQ(counted(0, "frame"), "0 frames");
  EXPECT_EQ(counted(1, "frame"), "1 frame");
  EXPECT_EQ(counted(2, "pass"), "2 passes");
}

}  // namespace
}  // namespace stillmap
