// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Everything that a user can set, with the values of preset fused as defaults. Each option is
/// addressed as group.name in a YAML file and in `--set group.name=value`; docs/options.md lists
/// all of them with their ranges. Values outside their range are refused by check_options().
struct Options {
  /// The part of a recording that is processed: `stillmap run` applies it to the recording, and
  /// Slam to the frames that are pushed.
  struct Input {
    /// Number of frames skipped at the start of the recording.
    int first = 0;
    /// Maximum number of frames used, counted before the stride; 0 uses all.
    int count = 0;
    /// Every n-th frame is used.
    int stride = 1;
    /// Whether images are processed at half their width and height.
    bool half_size = false;
  };
  /// ORB keypoints.
  struct Features {
    /// Maximum number of keypoints per image, over all pyramid levels.
    int keypoints = 1000;
    /// Number of levels of the scale pyramid.
    int levels = 8;
    /// Scale factor between neighboring pyramid levels.
    double scale_factor = 1.2;
    /// FAST corner threshold; cells without such a corner are searched again with threshold 7.
    int fast_threshold = 20;  // [gray levels]
    /// Family of AprilTags whose corners are landmarks; a tag must not be moved, nor be there
    /// twice.
    std::string tags = "none";
  };
  /// The object detector.
  struct Network {
    /// Network (.onnx) for detection or segmentation, such as YOLO or RF-DETR; empty for none.
    std::string model;
    /// Folder with one mask (8-bit PNG) per frame, used instead of a network; empty for none.
    std::string masks;
    /// Inference library; auto takes the fastest one that is installed.
    std::string backend = "auto";
    /// Device of the network; auto takes the first of these that works, and cpu otherwise.
    std::string device = "auto";
    /// Number of threads of the network.
    int threads = 1;
    /// Detections of lower confidence are dropped.
    double confidence = 0.25;
    /// The network runs on every n-th frame; in realtime it runs on at most every n-th. 0 means 1
    /// on the devices cuda and tensorrt, and 3 on others.
    int every = 0;
    /// Number of frames after which the masks of a frame reach the tracker (lockstep). With 0 the
    /// tracker waits for them in both schedules. -1 means 0 on the devices cuda and tensorrt, and 2
    /// on others.
    int mask_delay = -1;  // [frames]
    /// Masks are propagated to newer frames up to this age.
    int max_mask_age = 30;  // [frames]
  };
  /// The decision which keypoints move.
  struct Motion {
    /// Motion cues that are combined, in this order; an empty list treats the world as static.
    std::vector<std::string> cues = {"residual", "free-space", "surface", "history", "semantic"};
    /// Classes of objects that move by themselves; "unknown" is the class of mask folders.
    std::vector<std::string> moving_classes = {"person", "unknown"};
    /// Classes of objects that may be moved by somebody and are tested by the cues box-flow and
    /// epipolar.
    std::vector<std::string> potential_classes = {
        "chair",      "book",       "backpack",     "umbrella",       "handbag",   "suitcase",
        "bottle",     "wine glass", "cup",          "bowl",           "laptop",    "mouse",
        "keyboard",   "remote",     "cell phone",   "skateboard",     "frisbee",   "sports ball",
        "teddy bear", "scissors",   "vase",         "hair drier",     "tie",       "skis",
        "snowboard",  "kite",       "baseball bat", "baseball glove", "surfboard", "tennis racket",
        "fork",       "knife",      "spoon",        "banana",         "apple",     "sandwich",
        "orange",     "broccoli",   "carrot",       "hot dog",        "pizza",     "donut",
        "cake",       "toothbrush"};
    /// Masks are grown by this margin before keypoints are looked up in them, where no cue judges
    /// whole surfaces.
    int mask_dilation = 5;  // [pixels]
    /// Log-odds against "static" of a detection of confidence 1, where a cue also measures the
    /// motion of surfaces.
    double semantic_prior = 4;
    /// A keypoint moves if its optical flow differs from the mean background flow by more than this
    /// multiple of the mean flow's norm (cue box-flow).
    double box_flow_threshold = 0.5;
    /// Part of the box of a moving class whose keypoints are excluded without a test of their flow:
    /// memory (surfaces that moved in one of the last 10 frames), depth (the largest cluster of
    /// depths in the box) or none (cue box-flow).
    std::string box_flow_body = "memory";
    /// Image transformation that predicts the keypoints from the previous frame: homography, or
    /// se2, the rotation and translation in the image nearest to it (cue gated-semantic).
    std::string gate_transform = "homography";
    /// A keypoint is marked if the transformation between two frames misses it by this or more (cue
    /// gated-semantic).
    double gate_warp_error = 1.7;  // [pixels]
    /// A frame is marked if more than this share of its keypoints is (cue gated-semantic).
    double gate_marked_share = 0.1;
    /// A keypoint moves if it is farther than this from its epipolar line (cue epipolar).
    double epipolar_threshold = 1.96;  // [pixels]
  };
  /// Camera tracking and the choice of keyframes.
  struct Tracking {
    /// Number of landmarks from which a pose needs no further support; with fewer, points of the
    /// previous frame must agree with it.
    int min_inliers = 25;
    /// Steps beyond ORB-SLAM: subpixel (corners are refined to sub-pixel accuracy),
    /// foreground-depth (a keypoint at a depth edge takes the depth of the nearer side),
    /// sensor-noise (depths are weighted by the noise model of the sensor instead of the pixel
    /// noise), previous-frame-points (points of the previous frame that are no landmarks support
    /// poses with few landmarks), exposure (keypoints are corrected for the camera's motion during
    /// the exposure), occlusion (landmarks behind a nearer surface do not count as missed),
    /// consistency (poses that contradict the motion of the camera give no keyframe),
    /// sharp-keyframes (blurred frames give no keyframe), three-views (a frame is compared with the
    /// landmarks of the reference keyframe that three keyframes observe, not two), far-landmarks
    /// (landmarks are created from depths up to twice as far), odometry (tracking continues by
    /// visual odometry outside a map that is not extended), gyroscope (rotations by the gyroscope
    /// of the camera's IMU support poses, if it has one), dead-reckoning (IMU and wheels give the
    /// pose of a lost camera), rest (a camera on a tripod keeps its pose) and depth-error (the
    /// smooth error of the depth sensor is estimated in the first keyframes and removed).
    std::vector<std::string> extensions = {"subpixel",       "foreground-depth",
                                           "sensor-noise",   "previous-frame-points",
                                           "exposure",       "occlusion",
                                           "consistency",    "sharp-keyframes",
                                           "three-views",    "far-landmarks",
                                           "odometry",       "gyroscope",
                                           "dead-reckoning", "rest",
                                           "depth-error"};
    /// Number of frames without a pose after which a new map is started.
    int new_map_after = 10;  // [frames]
    /// Minimum number of frames between two keyframes.
    int keyframe_gap = 5;  // [frames]
    /// A keyframe is added at a rotation beyond this from every keyframe nearby.
    double keyframe_rotation = 15;  // [degrees]
    /// A keyframe is added at a distance beyond this share of the median depth from every keyframe
    /// nearby.
    double keyframe_translation = 0.25;
  };
  /// The sparse map.
  struct Map {
    /// Maximum number of keyframes that a local bundle adjustment moves.
    int local_window = 15;
    /// Number of covisible keyframes with which the landmarks of a new keyframe are fused; 0 turns
    /// fusion off.
    int fusion_keyframes = 10;
    /// Rules that erase landmarks in addition to those of ORB-SLAM: seen-through (the depth image
    /// sees through them, so their surface has left; also all landmarks of a map that was started
    /// on moving objects), repeated (equation 9 of the paper of preset gated-seg, over matched
    /// landmarks) and repeated-all-pairs (the same over all pairs in a vocabulary node).
    std::vector<std::string> landmark_rules = {"seen-through"};
    /// Whether loops are closed and maps are merged.
    bool loops = true;
    /// Whether global bundle adjustment is applied at the end of a run, and all frames are tracked
    /// again in its map.
    bool final_adjustment = true;
    /// Whether poses are smoothed with noise levels estimated from the run: those returned during
    /// the run by the frames before, the trajectory at its end by all frames.
    bool smooth_trajectory = true;
  };
  /// Moving objects.
  struct Movers {
    /// Whether moving objects are detected and tracked in the world frame.
    bool enabled = true;
  };
  /// The dense map of static surfaces.
  struct Dense {
    /// Whether the dense map is made.
    bool enabled = true;
    /// Side of the voxels of the dense cloud.
    double voxel = 0.01;  // [m]
    /// Every n-th pixel of a view is used, in both directions.
    int stride = 2;  // [pixels]
    /// Larger depths are left out, except on far surfaces; 0 leaves out depths whose standard
    /// deviation is larger than that of a Kinect v1 at 4 m.
    double max_depth = 0;  // [m]
    /// Smooth surfaces are averaged and used up to this standard deviation of a depth; 0 leaves far
    /// surfaces out. The default is that of a Kinect v1 at 5 m.
    double far_sigma = 0.041404;  // [m]
    /// A frame that is no keyframe is considered after this many frames; 0 uses keyframes only,
    /// without averaging of depths.
    int every = 15;  // [frames]
    /// Way of making the dense map: votes (depths are averaged, and voxels that other views see
    /// through are removed), keyframes (the clouds of the keyframes are stitched, as in the papers)
    /// or registered (each cloud is first registered to those before it by ICP).
    std::string method = "votes";
    /// Memory for the views of the dense map (five sixths) and the features of keyframes; those not
    /// used for the longest time are kept in temporary files without a name, by default in the
    /// folder of the results. The map does not depend on it.
    int memory = 180;  // [MB]
    /// Points are dropped whose distance to their neighbors exceeds the mean by this many standard
    /// deviations; 0 keeps all points.
    double outlier_deviations = 0;
    /// Masks of excluded objects are grown by this margin.
    int mask_dilation = 6;  // [pixels]
    /// Classes of objects that are left out of the dense map, whether they move or not.
    std::vector<std::string> excluded_classes = {"person", "unknown", "bird",
                                                 "cat",    "dog",     "horse"};
  };
  /// The mesh and the files for planners, which are made on request.
  struct Outputs {
    /// Side of the voxels of the mesh.
    double mesh_voxel = 0.01;  // [m]
    /// Side of the cells of the occupancy grids.
    double planner_cell = 0.05;  // [m]
    /// Lower end of the height band of the floor plan, above the floor.
    double planner_lowest = 0.1;  // [m]
    /// Upper end of the height band of the floor plan, above the floor.
    double planner_highest = 1.8;  // [m]
  };
  /// The time at which results of other threads reach the tracker.
  struct Schedule {
    /// lockstep uses each result at a fixed later frame, so that runs are repeatable; realtime uses
    /// it as soon as it is ready.
    std::string mode = "lockstep";
    /// Number of frames after which the landmarks of a new keyframe are visible (lockstep).
    int insert_delay = 1;  // [frames]
    /// Number of frames after which the refined map around a new keyframe is visible (lockstep).
    int refine_delay = 5;  // [frames]
  };

  Input input;
  Features features;
  Network network;
  Motion motion;
  Tracking tracking;
  Map map;
  Movers movers;
  Dense dense;
  Outputs outputs;
  Schedule schedule;

  bool realtime() const { return schedule.mode == "realtime"; }

  /// Returns the name or file of the preset that the options are based on. Only read_options()
  /// chooses a preset.
  const std::string& preset() const { return preset_; }

 private:
  friend Options read_options(const std::string& preset, const std::filesystem::path& file);

  std::string preset_ = "fused";
};

/// A preset: a YAML file of options that differ from the defaults.
struct Preset {
  std::string name;
  std::string description;  ///< First comment line of its file.
  std::string text;         ///< Content of its file.
};

/// Returns all presets by name: the built-in ones, and those in the folder that the environment
/// variable STILLMAP_PRESETS names. A file there replaces the preset of the same name.
std::vector<Preset> presets();

/// Returns the options of a preset, overridden by those of a YAML file.
/// @param preset  name or file; empty for the one that the YAML file names under `preset`, or fused
/// @param file    empty for none
/// Throws Error with file, line and the nearest known name for an unknown option, for a value of
/// the wrong type or outside its range, and if `preset` and `file` name different presets.
Options read_options(const std::string& preset = {}, const std::filesystem::path& file = {});

/// Overrides one option by an assignment "group.name=value". A list is a YAML list, "[a, b]", or
/// its items separated by commas, "a, b". Throws Error as read_options() does.
void set_option(const std::string& assignment, Options& options);

/// Throws Error for an option outside its range, and names the range.
void check_options(const Options& options);

/// Returns all options as YAML that read_options() reads back, with description, unit, range and
/// default of each as comments.
std::string options_yaml(const Options& options);

}  // namespace stillmap
