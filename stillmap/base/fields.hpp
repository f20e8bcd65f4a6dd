// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <type_traits>

/// Reflection for plain option structs with defaults. A struct lists its fields once:
///
///     struct OrbOptions {
///       int keypoints = 1000;  ///< Maximum number of keypoints per image.
///       STILLMAP_FIELDS(keypoints)
///     };
///
/// `for_each_field(options, f)` then calls f(name, member) for each field in order; nested structs
/// are fields like any other. Up to 24 fields.
#define STILLMAP_FIELDS(...)                                \
  template <typename Self, typename Visitor>                \
  static void visit_fields(Self& self, Visitor&& visitor) { \
    STILLMAP_FIELDS_EACH(__VA_ARGS__)                       \
  }

#define STILLMAP_FIELDS_ONE(name) visitor(#name, self.name);
#define STILLMAP_FIELDS_PARENS ()
#define STILLMAP_FIELDS_EXPAND(...) \
  STILLMAP_FIELDS_EXPAND3(STILLMAP_FIELDS_EXPAND3(STILLMAP_FIELDS_EXPAND3(__VA_ARGS__)))
#define STILLMAP_FIELDS_EXPAND3(...) \
  STILLMAP_FIELDS_EXPAND2(STILLMAP_FIELDS_EXPAND2(STILLMAP_FIELDS_EXPAND2(__VA_ARGS__)))
#define STILLMAP_FIELDS_EXPAND2(...) \
  STILLMAP_FIELDS_EXPAND1(STILLMAP_FIELDS_EXPAND1(STILLMAP_FIELDS_EXPAND1(__VA_ARGS__)))
#define STILLMAP_FIELDS_EXPAND1(...) __VA_ARGS__
#define STILLMAP_FIELDS_EACH(...) \
  __VA_OPT__(STILLMAP_FIELDS_EXPAND(STILLMAP_FIELDS_STEP(__VA_ARGS__)))
#define STILLMAP_FIELDS_STEP(first, ...) \
  STILLMAP_FIELDS_ONE(first)             \
  __VA_OPT__(STILLMAP_FIELDS_AGAIN STILLMAP_FIELDS_PARENS(__VA_ARGS__))
#define STILLMAP_FIELDS_AGAIN() STILLMAP_FIELDS_STEP

namespace stillmap {

/// A struct with fields listed by STILLMAP_FIELDS.
template <typename T>
concept HasFields = requires(T& t) {
  T::visit_fields(t, [](const char*, auto&) {});
};

/// Calls visitor(const char* name, Member& member) for each listed field of `options`, in order.
template <typename Options, typename Visitor>
void for_each_field(Options& options, Visitor&& visitor) {
  std::remove_const_t<Options>::visit_fields(options, visitor);
}

}  // namespace stillmap
