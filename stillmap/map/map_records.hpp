// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/map/map.hpp"

/// Single keyframes and landmarks as bytes. The functions that read throw Error for invalid values.
namespace stillmap {

/// Bound on plausible coordinates [pixels or m].
constexpr double kHuge = 1e6;
constexpr int kMaxSide = 8192;  // of an image [pixels]
/// Bound on sequence, session and component numbers, which count up by one.
constexpr std::uint32_t kMaxCount = 1U << 31;

/// Returns whether a number is in a range; false for NaN.
inline bool finite_within(double value, double least, double most) {
  return value >= least && value <= most;
}

/// Writes the numbers, timestamp and pose of a keyframe.
/// @param first  whether it defines the world frame of its component
void put_keyframe_state(ByteWriter& out, const Keyframe& k, bool first);
/// @returns whether the keyframe defines the world frame of its component
bool get_keyframe_state(ByteReader& in, Keyframe& k);

/// Writes the keypoints of a keyframe with their weights, which never change.
void put_keypoints(ByteWriter& out, const Keyframe& k);
/// Sets keypoints and weights; the keypoints show no landmarks yet.
void get_keypoints(ByteReader& in, const Camera& camera, const PyramidShape& pyramid, Keyframe& k);

/// Fails if a landmark has a value that is not finite or out of range.
void require_valid(const ByteReader& in, const Landmark& l);
/// Writes a landmark with its observations.
void put_landmark(ByteWriter& out, const Landmark& l);
/// Returns a landmark without its id; whether its observations exist is not checked.
Landmark get_landmark(ByteReader& in);

}  // namespace stillmap
