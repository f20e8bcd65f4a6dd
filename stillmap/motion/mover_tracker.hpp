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

/// A mover in one frame. World frame, meters and meters per second.
struct MoverSample {
  std::size_t frame_index = 0;
  double timestamp = 0;   ///< [s]
  bool observed = false;  ///< Whether it is detected in this frame, not predicted.
  bool moves = false;     ///< Whether it is detected in this frame as moving.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [m]; see MoverDetector.
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< [m/s]
  Eigen::AlignedBox3d box;      ///< Box around the whole object, moved along while predicted [m].
  Eigen::AlignedBox3d surface;  ///< Box around the surface visible in the last detection [m].
};

/// The state of a mover at a frame.
struct Mover {
  int id = 0;                            ///< 1, 2, 3 ... in the order of their births.
  std::string class_name = "unknown";    ///< Class with the largest sum of confidences.
  double class_confidence = 0;           ///< Mean over all detections [0..1].
  double first_seen = 0, last_seen = 0;  ///< [s]
  MoverSample now;
};

/// The whole path of a mover, from the first detection to the last.
struct MoverTrack {
  int id = 0;
  std::string class_name = "unknown";
  double class_confidence = 0;
  double first_seen = 0, last_seen = 0;  ///< [s]
  /// One per frame with a pose in this time; frames without a detection have predictions. Frames
  /// between two joined tracks have none; see joined_movers().
  std::vector<MoverSample> samples;
  int world = 0;               ///< Number of restarts before; see MoverTracker::restart().
  Appearance appearance = {};  ///< Colors, over all detections.
};

/// Returns a sample after a correction of the world: T maps old to new coordinates. Boxes grow by
/// the rotation, which is small.
MoverSample moved(const MoverSample& sample, const Pose& T);

/// Tracks detections over time: one Kalman filter per object in the world frame (constant velocity,
/// white acceleration: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and
/// Navigation, 2001, section 6.2.2; the same noise along all axes, so that one 2 x 2 covariance
/// serves the three), detections assigned by least total cost (squared Mahalanobis distance plus
/// the log-determinant of its covariance, plus the squared distance of the appearances) within a
/// gate. Different known classes are never assigned to each other; an unknown object may turn out
/// to be a person.
///
/// If a nearer surface or the image border hides one end of an object of a known class that was
/// fully visible before, the remembered extent gives the length of the hidden part, and the
/// centroid and the box are completed by it: a person who walks behind a table does not rise by
/// half a leg.
///
/// A track is born by three moving detections in a row; detections at rest keep it alive: a person
/// who stops stays a track with a velocity near zero as long as an instance is detected. (Without a
/// network, an object that stops has no detections any more and becomes part of the static world.)
/// An object of a known class is continued by detections without a class that do not move, such as
/// the wall behind a person who left, for 1.5 seconds only; at its end they are left out.
/// A track survives 1.5 seconds without a detection, with a decaying velocity, and is found again
/// within that time; one that returns later gets a new track, which joined_movers() may join at the
/// end of the run. Two tracks that stay within each other are one object with the older id.
/// Synchronous and deterministic: ids follow from the input.
class MoverTracker {
 public:
  /// Adds the next frame with a pose; indices and timestamps increase.
  void update(std::size_t frame_index, double timestamp, const Pose& T_world_camera,
              const std::vector<MoverDetection>& detections);

  /// Moves the objects along with a corrected world; samples stay as they were.
  void move(const Pose& T_corrected_world);
  /// Ends all tracks, as a new world begins (tracking was lost).
  void restart();

  /// Returns the movers of the newest frame by id, detected or predicted.
  std::vector<Mover> current() const;

  /// Returns all tracks so far by id, moved with the corrected poses of the frames: samples stay in
  /// place relative to the camera. Boxes grow by the rotation of the correction, which is small.
  /// @param pose_of returns the present T_world_camera of a frame; samples of frames without are
  ///   left out
  std::vector<MoverTrack> tracks(
      const std::function<std::optional<Pose>(std::size_t frame_index)>& pose_of) const;

  /// Returns the tracks that have samples in a frame or later, by id and with these samples only,
  /// in the world as it was at their frames.
  std::vector<MoverTrack> tracks_since(std::size_t frame_index) const;
  /// Returns T_world_camera of the frames with samples, as given to update().
  const std::map<std::size_t, Pose>& poses() const { return T_world_camera_; }

 private:
  struct Track {
    int id = 0;  // 0 before its birth
    Eigen::Vector3d p, v;
    Eigen::Matrix2d P;  // covariance of position and velocity along any axis
    Eigen::AlignedBox3d box_offset, surface_offset;  // relative to p [m]
    std::array<std::optional<double>, 2> extent;  // along the camera's axes when fully visible [m]
    int detections = 0;
    double confirmed = 0;  // time of the last detection that has a class or moves [s]
    int world = 0;
    Appearance appearance;
    std::map<std::string, double> votes;  // sum of confidences by class
    std::vector<MoverSample> samples;
    std::map<int, int>
        inside;  // number of frames in a row within the box of another track, by its id
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
  void add_sample(Track& track, const MoverDetection* detection) const;
  void retire();
  void merge();
  void absorb(Track& older, const Track& younger) const;
  void archive(Track&& track);
  Mover mover(const Track& track) const;
  MoverTrack without_samples(const Track& track) const;

  std::vector<Track> tracks_;  // alive, in the order of their first detection
  std::vector<Track> ended_;   // ended after their birth
  std::map<std::size_t, Pose>
      T_world_camera_;  // poses of frames with samples, as given to update()
  std::size_t frame_index_ = 0;
  std::optional<double> timestamp_;
  int newest_id_ = 0;
  int world_ = 0;  // number of restarts
};

}  // namespace stillmap
