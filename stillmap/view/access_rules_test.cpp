// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/access_rules.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const ViewAddress kLocal{"127.0.0.1", 8360, ""};
const ViewAddress kOpen{"0.0.0.0", 8360, "secret"};

AccessRequest own_page(const std::string& host, const std::string& token = "") {
  return {.method = "GET", .host = host, .origin = "http://" + host, .token = token};
}

TEST(AccessRules, ThePageOfTheViewItselfMayReadTheData) {
  EXPECT_FALSE(refusal(own_page("127.0.0.1:8360"), kLocal, true));
  EXPECT_FALSE(refusal(own_page("localhost:8360"), kLocal, true));
  EXPECT_FALSE(refusal(own_page("[::1]:8360"), {"::1", 8360, ""}, true));
}

TEST(AccessRules, APageOfAnotherSiteMayNot) {
  AccessRequest request = own_page("127.0.0.1:8360");
  request.origin = "http://evil.example";
  EXPECT_TRUE(refusal(request, kLocal, true));
  request.origin = "http://127.0.0.1:9999";  // another server on this computer
  EXPECT_TRUE(refusal(request, kLocal, true));
  request.origin = "null";  // a file, or a sandboxed frame
  EXPECT_TRUE(refusal(request, kLocal, true));
}

TEST(AccessRules, ANameThatWasReboundToThisComputerIsRefused) {
  EXPECT_TRUE(refusal(own_page("evil.example:8360"), kLocal, true));
  EXPECT_TRUE(refusal(own_page("evil.example:8360"), kLocal, false));
  EXPECT_TRUE(refusal(own_page("127.evil.example"), kLocal, true));
}

TEST(AccessRules, ProgramsThatAreNoBrowserSendNoOrigin) {
  AccessRequest request = own_page("127.0.0.1:8360");
  request.origin.reset();
  EXPECT_FALSE(refusal(request, kLocal, true));
}

TEST(AccessRules, DataForOthersNeedsTheWholeToken) {
  EXPECT_FALSE(refusal(own_page("192.168.1.7:8360", "secret"), kOpen, true));
  for (const char* wrong : {"", "secre", "secrets", "Secret"})
    EXPECT_TRUE(refusal(own_page("192.168.1.7:8360", wrong), kOpen, true)) << wrong;
  EXPECT_FALSE(refusal(own_page("192.168.1.7:8360"), kOpen, false));  // the page without data
}

TEST(AccessRules, NothingCanBeWritten) {
  AccessRequest request = own_page("127.0.0.1:8360");
  for (const char* method : {"POST", "PUT", "DELETE"}) {
    request.method = method;
    EXPECT_TRUE(refusal(request, kLocal, false)) << method;
  }
}

TEST(AccessRules, TokensAreLongAndDiffer) {
  EXPECT_EQ(random_token().size(), 32U);
  EXPECT_NE(random_token(), random_token());
}

}  // namespace
}  // namespace stillmap
