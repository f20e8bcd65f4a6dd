// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/base64.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Base64, HasTheCodesOfTheStandard) {  // RFC 4648, section 10
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe"), "//4=");
}

}  // namespace
}  // namespace stillmap
