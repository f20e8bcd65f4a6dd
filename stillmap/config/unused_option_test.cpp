// SPDX-License-Identifier: Apache-2.0
#include "stillmap/config/unused_option.hpp"

#include "stillmap/config/option_values.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

Options options_with(std::initializer_list<const char*> assignments, const char* preset = "fused") {
  Options options = read_options(preset);
  for (const char* assignment : assignments) set_option(assignment, options);
  return options;
}

std::string reason(const std::string& path, const Options& options) {
  return why_unused(path, options).value_or("");
}

TEST(UnusedOption, OfTheNetworkNeedsANetwork) {
  EXPECT_THAT(reason("network.every", read_options()), HasSubstr("--model"));
  EXPECT_THAT(reason("network.mask_delay", read_options()), HasSubstr("--masks"));
  const Options network = options_with({"network.model=some.onnx"});
  EXPECT_EQ(reason("network.every", network), "");
  EXPECT_EQ(reason("network.mask_delay", network), "");
  const Options both = options_with({"network.model=some.onnx", "network.masks=mask"});
  EXPECT_THAT(reason("network.model", both), HasSubstr("instead"));
  EXPECT_THAT(reason("network.threads", both), HasSubstr("instead"));
  EXPECT_EQ(reason("network.max_mask_age", both), "");
}

TEST(UnusedOption, OfACueNeedsTheCue) {
  EXPECT_THAT(reason("motion.box_flow_threshold", read_options("fused")), HasSubstr("box-flow"));
  EXPECT_EQ(reason("motion.box_flow_threshold", read_options("box-flow")), "");
  EXPECT_THAT(reason("motion.gate_transform", read_options("box-flow")), HasSubstr("gated"));
  EXPECT_EQ(reason("motion.gate_transform", read_options("gated-seg")), "");
  EXPECT_EQ(reason("motion.epipolar_threshold", read_options("box-epipolar")), "");
}

TEST(UnusedOption, OfTheDenseMapNeedsTheDenseMap) {
  const Options none = options_with({"dense.enabled=false"});
  EXPECT_THAT(reason("dense.voxel", none), HasSubstr("dense.enabled is false"));
  EXPECT_THAT(reason("outputs.mesh_voxel", none), HasSubstr("dense.enabled is false"));
  EXPECT_EQ(reason("dense.enabled", none), "");
  EXPECT_EQ(reason("dense.voxel", read_options()), "");
}

TEST(UnusedOption, OfLockstepIsNotForRealtime) {
  EXPECT_EQ(reason("schedule.refine_delay", read_options()), "");
  EXPECT_THAT(reason("schedule.refine_delay", options_with({"schedule.mode=realtime"})),
              HasSubstr("lockstep"));
}

TEST(UnusedOption, NamesKnownOptionsOnly) {
  // Each option has an effect in one of these.
  const std::vector<Options> all{options_with({"network.model=some.onnx"}),
                                 options_with({"network.masks=mask"}), read_options("box-flow"),
                                 read_options("gated-seg"), read_options("box-epipolar")};
  const Options defaults;
  visit_options(defaults, [&](const OptionInfo& info, const auto&) {
    EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Options& options) {
      return !why_unused(info.path, options);
    })) << info.path;
  });
}

}  // namespace
}  // namespace stillmap
