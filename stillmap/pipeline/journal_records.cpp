// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/journal_records.hpp"

#include "stillmap/map/pose_bytes.hpp"

#include <cmath>
#include <concepts>
#include <type_traits>

namespace stillmap {
namespace {

template <typename T>
concept Number = std::is_arithmetic_v<T>;

/// Writes one value after the other.
struct Put {
  ByteWriter& out;
  template <Number T>
  void operator()(const T& number) {
    out.put(number);
  }
  template <typename T>
  requires std::is_enum_v<T>
  void operator()(const T& value, T /*last*/) { out.put(static_cast<std::uint8_t>(value)); }
  template <int Rows, int Columns>
  void operator()(const Eigen::Matrix<double, Rows, Columns>& matrix) {
    for (const double x : matrix.reshaped()) out.put(x);
  }
  void operator()(const std::string& text) { out.put_text(text); }
  void operator()(const Pose& pose) { put_pose(out, pose); }
  void operator()(const KeyframeId& id) {
    out.put(id.slot);
    out.put(id.generation);
  }
  void operator()(const Appearance& colors) { out.put(colors); }
};

/// Reads one value after the other.
struct Get {
  ByteReader& in;
  template <Number T>
  void operator()(T& number) {
    number = in.get<T>();
    if constexpr (std::is_floating_point_v<T>) {
      if (!std::isfinite(number)) in.fail("a number is not finite");
    }
  }
  void operator()(bool& value) { value = in.get<std::uint8_t>() != 0; }
  template <typename T>
  requires std::is_enum_v<T>
  void operator()(T& value, T last) {
    const auto number = in.get<std::uint8_t>();
    if (number > static_cast<std::uint8_t>(last)) in.fail("a kind is out of range");
    value = static_cast<T>(number);
  }
  template <int Rows, int Columns>
  void operator()(Eigen::Matrix<double, Rows, Columns>& matrix) {
    for (double& x : matrix.reshaped()) x = in.get<double>();
  }
  void operator()(std::string& text) { text = in.get_text(); }
  void operator()(Pose& pose) { pose = get_pose(in); }
  void operator()(KeyframeId& id) {
    id.slot = in.get<std::uint32_t>();
    id.generation = in.get<std::uint32_t>();
  }
  void operator()(Appearance& colors) { colors = in.get<Appearance>(); }
};

// The fields of each kind, in the order of the file, for both directions. `Io` is Put with a
// constant value, or Get.

template <typename Io, typename Value>
void visit(Io io, Value& value) requires std::same_as<std::remove_const_t<Value>, FrameRecord> {
  io(value.index);
  io(value.timestamp);
  io(value.state, TrackState::kPredicted);
  io(value.reason);
  io(value.reference);
  io(value.T_reference_camera);
  io(value.covariance);
  io(value.T_camera_filtered);
  for (auto& coordinate : value.up) io(coordinate);
  for (auto* count : {&value.keypoints, &value.moving_keypoints, &value.inliers, &value.mask_age})
    io(*count);
  for (auto* flag : {&value.relocalized, &value.tracked_by_odometry, &value.tracked_late})
    io(*flag);
  io(value.uncertainty, Uncertainty::kMinority);
  io(value.keyframe);
  io(value.dynamics, Dynamics::kHigh);
  for (auto* time : {&value.times.features, &value.times.masks, &value.times.motion,
                     &value.times.pose, &value.times.waiting})
    io(*time);
}

template <typename Io, typename Value>
void visit(Io io, Value& value) requires std::same_as<std::remove_const_t<Value>, RelativePlace> {
  io(value.keyframe);
  io(value.T_keyframe_camera);
}

template <typename Io, typename Value>
void visit(Io io, Value& value) requires std::same_as<std::remove_const_t<Value>, MapEvent> {
  io(value.kind, MapEvent::Kind::kDropped);
  io(value.frame_index);
  io(value.timestamp);
  io(value.seen_in);
  io(value.inliers);
  io(value.fused);
  io(value.meters);
  io(value.radians);
  io(value.keyframes);
  io(value.graph_ms);
  io(value.milliseconds);
}

template <typename Io, typename Value>
void visit(Io io, Value& value) requires std::same_as<std::remove_const_t<Value>, MoverTrack> {
  io(value.id);
  io(value.class_name);
  io(value.class_confidence);
  io(value.world);
  io(value.appearance);
}

template <typename Io, typename Value>
void visit(Io io, Value& value) requires std::same_as<std::remove_const_t<Value>, PlacedSample> {
  auto& sample = value.sample;
  io(sample.frame_index);
  io(sample.timestamp);
  io(sample.observed);
  io(sample.moves);
  io(sample.centroid);
  io(sample.velocity);
  for (auto* box : {&sample.box, &sample.surface}) {
    io(box->min());
    io(box->max());
  }
  io(value.T_world_camera);
}

template <typename Value>
void put(ByteWriter& out, const Value& value) {
  visit(Put{out}, value);
}

template <typename Value>
Value get(ByteReader& in) {
  Value value;
  visit(Get{in}, value);
  in.expect_end();
  return value;
}

}  // namespace

void put_frame(ByteWriter& out, const FrameRecord& record) { put(out, record); }
FrameRecord get_frame(ByteReader& in) { return get<FrameRecord>(in); }

void put_place(ByteWriter& out, const RelativePlace& place) { put(out, place); }
RelativePlace get_place(ByteReader& in) { return get<RelativePlace>(in); }

void put_event(ByteWriter& out, const MapEvent& event) { put(out, event); }
MapEvent get_event(ByteReader& in) { return get<MapEvent>(in); }

void put_identity(ByteWriter& out, const MoverTrack& track) { put(out, track); }
MoverTrack get_identity(ByteReader& in) { return get<MoverTrack>(in); }

void put_sample(ByteWriter& out, const PlacedSample& sample) { put(out, sample); }
PlacedSample get_sample(ByteReader& in) { return get<PlacedSample>(in); }

}  // namespace stillmap
