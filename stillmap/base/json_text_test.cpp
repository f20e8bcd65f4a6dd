// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/json_text.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(JsonText, ZerosHaveNoSign) {
  const nlohmann::json json{
      {"a", -0.0}, {"b", {1, -0.0, {{"c", -0.0}}}}, {"d", "-0.0"}, {"e", -0.5}};
  EXPECT_EQ(json_text(json), R"({"a":0.0,"b":[1,0.0,{"c":0.0}],"d":"-0.0","e":-0.5})");
}

TEST(JsonText, BytesThatAreNoUtf8AreReplaced) {
  EXPECT_EQ(json_text(nlohmann::json("\xe4")), "\"\xef\xbf\xbd\"");
}

}  // namespace
}  // namespace stillmap
