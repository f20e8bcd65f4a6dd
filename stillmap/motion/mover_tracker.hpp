// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/motion/mover_detection.hpp"

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A mover in one frame. Meters, meters per second, world frame.
struct MoverSample {
  std::size_t frame_index = 0;
  double timestamp = 0;   ///< seconds
  bool observed = false;  ///< seen in this frame; else predicted
  bool moves = false;     ///< seen, and judged to move; false: it stands, or is predicted
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< see MoverDetector for its meaning
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  Eigen::AlignedBox3d box;      ///< with what is not seen; carried along while predicted
  Eigen::AlignedBox3d surface;  ///< around what was seen last
};

/// A mover as it is known at a frame.
struct Mover {
  int id = 0;                            ///< 1, 2, 3 ... in the order of their becoming known
  std::string class_name = "unknown";    ///< what most of its detections say
  double class_confidence = 0;           ///< mean over all detections, 0 to 1
  double first_seen = 0, last_seen = 0;  ///< seconds
  MoverSample now;
};

/// The whole of a mover's way, from the first detection to the last.
struct MoverTrack {
  int id = 0;
  std::string class_name = "unknown";
  double class_confidence = 0;
  double first_seen = 0, last_seen = 0;  ///< seconds
  /// One per frame between the two that has a pose; unseen stretches are predictions.
  std::vector<MoverSample> samples;
};

/// Follows detections over time: one Kalman filter per thing in the world frame (constant velocity,
/// white acceleration: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and
/// Navigation, 2001, section 6.2.2; the same noise along all axes, so that one 2 x 2 covariance
/// serves the three), detections assigned by least total cost (squared Mahalanobis distance plus
/// the log-determinant of its covariance) within a gate. A person is never taken for a chair, but
/// something unknown may turn out to be a person.
///
/// Where something nearer, or the image's border, hides one end of somebody (or something of a
/// known class) that was seen from end to end before, the remembered extent tells how far it goes
/// on: the centroid and the box are completed by that (somebody who walks behind a table does not
/// rise by half a leg).
///
/// A track is born by three detections in a row that move; detections that stand still keep it
/// alive: somebody who stops stays a track, his velocity near zero, as long as an instance shows
/// him. (What stops without a network to know it has no detections any more; it becomes part of
/// the static world.) A track survives 1.5 seconds unseen (going on
/// ever more slowly), and is found again within that time. Two tracks that stay within each other
/// are one thing; the older id stays. Synchronous and deterministic: ids follow from the input.
class MoverTracker {
 public:
  /// The next frame with a pose; indices and stamps rise.
  void update(std::size_t frame_index, double timestamp, const Pose& T_world_camera,
              const std::vector<MoverDetection>& detections);

  /// A new world begins (tracking was lost): all tracks end.
  void restart();

  /// The movers known at the newest frame, by id: seen in it, or predicted.
  std::vector<Mover> current() const;

  /// All tracks so far, by id, moved along with the frames' poses: what was seen from a frame stays
  /// where it was relative to the camera. Boxes are turned as a whole, which makes them larger, but
  /// poses hardly turn afterwards.
  /// @param pose_of T_world_camera of a frame as known now; none: its samples are left out
  std::vector<MoverTrack> tracks(
      const std::function<std::optional<Pose>(std::size_t frame_index)>& pose_of) const;

 private:
  struct Track {
    int id = 0;  ///< 0: not born yet
    Eigen::Vector3d p, v;
    Eigen::Matrix2d P;  ///< covariance of position and velocity along any axis
    Eigen::AlignedBox3d box_offset, surface_offset;  ///< relative to p
    std::array<std::optional<double>, 2> extent;  ///< across and along the camera's y axis, where
                                                  ///< it was seen from end to end [m]
    int detections = 0;
    std::map<std::string, double> votes;  ///< class: sum of confidences
    std::vector<MoverSample> samples;
    std::map<int, int> inside;  ///< id of another track: frames in a row within its box
    std::string class_name() const;
    double class_confidence() const;
    double last_seen() const;
  };

  void predict(Track& track, double timestamp) const;
  std::vector<int> assigned_tracks(const std::vector<MoverDetection>& detections) const;
  MoverDetection completed(const Track& track, const MoverDetection& detection) const;
  double cost(const Track& track, const MoverDetection& detection) const;
  void correct(Track& track, const MoverDetection& detection) const;
  void observe(Track& track, const MoverDetection& detection) const;
  bool is_fragment(const MoverDetection& detection) const;
  Track begin(const MoverDetection& detection) const;
  void note(Track& track, const MoverDetection* seen) const;
  void retire();
  void merge();
  void absorb(Track& older, const Track& younger) const;
  void archive(Track&& track);
  Mover mover(const Track& track) const;

  std::vector<Track> tracks_;                   // alive, in the order of their birth
  std::vector<Track> ended_;                    // those that were born
  std::map<std::size_t, Pose> T_world_camera_;  // of frames with a sample, as it was then
  std::size_t frame_index_ = 0;
  std::optional<double> timestamp_;
  int newest_id_ = 0;
};

}  // namespace stillmap
