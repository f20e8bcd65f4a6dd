// SPDX-License-Identifier: Apache-2.0
#include "stillmap/slam.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <map>
#include <mutex>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arguments.hpp"
#include "arrays.hpp"
#include "bindings.hpp"
#include "sources.hpp"
#include <opencv2/imgproc.hpp>

namespace stillmap::python {
namespace {

namespace py = pybind11;

constexpr const char* kPush = "push";

/// Largest timestamp [s], of the year 5138. Times since 1970 in milliseconds, microseconds and
/// nanoseconds are larger.
constexpr double kLatestStamp = 1e11;

/// Masks that are pushed with the frames, until the detector's thread has used them.
class PushedMasks {
 public:
  void add(std::size_t frame, cv::Mat1b mask) {
    const std::scoped_lock lock(mutex_);
    masks_[frame] = std::move(mask);
  }
  /// Returns the mask of a frame; empty if it has none. Those of earlier frames are forgotten.
  cv::Mat1b take(std::size_t frame) {
    const std::scoped_lock lock(mutex_);
    masks_.erase(masks_.begin(), masks_.lower_bound(frame));
    const auto found = masks_.find(frame);
    return found == masks_.end() ? cv::Mat1b() : found->second;
  }

 private:
  std::mutex mutex_;
  std::map<std::size_t, cv::Mat1b> masks_;
};

/// Returns the objects in the masks that are pushed with the frames.
class MaskDetector final : public Detector {
 public:
  explicit MaskDetector(std::shared_ptr<PushedMasks> masks) : masks_(std::move(masks)) {}

  std::vector<Instance> detect(const RgbdFrame& frame) override {
    cv::Mat1b mask = masks_->take(frame.index);
    if (mask.empty()) return {};
    if (mask.size() != frame.gray.size())  // frames of half the size
      cv::resize(mask, mask, frame.gray.size(), 0, 0, cv::INTER_NEAREST);
    return instances_of_mask(mask);
  }
  std::string description() const override { return "masks pushed with the frames"; }
  bool immediate() const override { return true; }
  const std::vector<std::string>& class_names() const override { return names_; }

 private:
  const std::shared_ptr<PushedMasks> masks_;
  const std::vector<std::string> names_ = {"person", "unknown"};
};

/// stillmap.Slam: Slam for any number of Python threads, whose calls wait for each other.
class PythonSlam {
 public:
  PythonSlam(const Camera& camera, const Options& options, bool masks,
             const std::optional<StartMap>& start)
      : camera_(camera),
        masks_(masks ? std::make_shared<PushedMasks>() : nullptr),
        slam_(camera, options, masks ? std::make_unique<MaskDetector>(masks_) : nullptr, start) {}

  /// Needs no GIL.
  /// @param depth  none: all depth is unknown
  PoseUpdate push(const LentImage& rgb, const std::optional<LentImage>& depth, double stamp,
                  const std::optional<LentImage>& mask) {
    const std::scoped_lock lock(mutex_);
    const cv::Mat depths = depth ? depth->mat() : cv::Mat(unknown_depth());
    return push_masked(slam_.make_frame(rgb.mat(), depths, stamp), mask);
  }
  PoseUpdate push(const Frame& frame, const std::optional<LentImage>& mask) {
    const std::scoped_lock lock(mutex_);
    require_camera(*frame.camera);
    return push_masked(frame.data, mask);
  }
  PoseUpdate push_stereo(const LentImage& left, const LentImage& right, double stamp,
                         const std::optional<LentImage>& mask) {
    const std::scoped_lock lock(mutex_);
    return push_masked(slam_.make_stereo_frame(left.mat(), right.mat(), stamp), mask);
  }
  /// Returns what the tracker saw in the newest frame; null before the first.
  std::shared_ptr<ObservedFrame> newest() const {
    const std::scoped_lock lock(mutex_);
    auto observed = slam_.newest();
    return observed ? std::make_shared<ObservedFrame>(*std::move(observed)) : nullptr;
  }
  std::shared_ptr<const Snapshot> snapshot() const { return slam_.snapshot(); }
  /// After Ctrl-C, Python raises KeyboardInterrupt when the call returns, and its result is lost. A
  /// second call returns the same results.
  std::shared_ptr<Results> finish() {
    const std::scoped_lock lock(mutex_);
    if (!results_) results_ = std::make_shared<Results>(slam_.finish());
    return results_;
  }
  /// Returns the results of finish(); null before.
  std::shared_ptr<Results> results() const {
    const std::scoped_lock lock(mutex_);
    return results_;
  }
  void keep_journal(const std::filesystem::path& file) {
    const std::scoped_lock lock(mutex_);
    slam_.keep_journal(file);
  }
  void push_imu(double stamp, const std::array<double, 3>& angular_velocity,
                const std::array<double, 3>& acceleration) {
    const std::scoped_lock lock(mutex_);
    slam_.push_imu({.timestamp = stamp,
                    .angular_velocity = Eigen::Vector3d(angular_velocity.data()),
                    .acceleration = Eigen::Vector3d(acceleration.data())});
  }
  void push_odometry(double stamp, const Matrix4& T_odom_base) {
    const std::scoped_lock lock(mutex_);
    slam_.push_odometry({stamp, motion_of(T_odom_base, "T_odom_base")});
  }
  void set_mode(Mode mode) {
    const std::scoped_lock lock(mutex_);
    slam_.set_mode(mode);
  }
  std::string load_map(const std::filesystem::path& file) {
    const std::scoped_lock lock(mutex_);
    return slam_.load_map(file);
  }
  void watch(const std::filesystem::path& rules) {
    const std::scoped_lock lock(mutex_);
    slam_.watch(rules);
  }
  std::vector<WarningEvent> warnings() const {
    const std::scoped_lock lock(mutex_);
    return slam_.warnings();
  }
  std::vector<Finding> findings() const {
    const std::scoped_lock lock(mutex_);
    return results_ ? results_->findings : slam_.findings();
  }
  std::vector<MovingObject> movers() const { return slam_.movers(); }
  std::vector<ObjectChange> changes() const { return slam_.changes(); }
  void save_map(const std::filesystem::path& file) const { slam_.save_map(file); }

 private:
  cv::Mat1f unknown_depth() const { return cv::Mat1f::zeros(camera_.height, camera_.width); }
  PoseUpdate push_masked(const RgbdFramePtr& frame, const std::optional<LentImage>& mask) {
    if (mask) {
      require_masks();
      const cv::Mat1b lent = mask->mat();
      if (lent.cols != camera_.width || lent.rows != camera_.height) {
        throw Error("the mask has another size than the images", kPush,
                    "give an array of (height, width)");
      }
      // The detector's thread uses the mask later, when Python may have changed it.
      masks_->add(frame->index, lent.clone());
    }
    return slam_.push(frame);
  }
  /// Throws Error for a frame of another camera.
  void require_camera(const Camera& camera) const {
    const auto intrinsics = [](const Camera& c) {
      return Eigen::Matrix<double, 6, 1>(c.width, c.height, c.fx, c.fy, c.cx, c.cy);
    };
    if (intrinsics(camera).isApprox(intrinsics(camera_), 1e-6)) return;
    throw Error("the frame is of a source with another camera", kPush,
                "make it with Slam(source.camera)");
  }
  void require_masks() const {
    if (masks_ == nullptr) {
      throw Error("this Slam expects no masks", kPush, "make it with Slam(camera, masks=True)");
    }
    if (camera_.distorted()) {
      throw Error("masks of a distorted camera are not rectified", kPush,
                  "push rectified images and masks of a camera without distortion");
    }
  }

  const Camera camera_;
  const std::shared_ptr<PushedMasks> masks_;  // null: no masks are expected
  mutable std::mutex mutex_;
  Slam slam_;
  std::shared_ptr<Results> results_;
};

/// Returns the camera that an object is, or that it names.
Camera camera_named(const py::object& camera) {
  if (py::isinstance<Camera>(camera)) return camera.cast<Camera>();
  if (fits<std::filesystem::path>(camera))
    return read_camera(camera.cast<std::filesystem::path>().string());
  throw Error("camera is of the type " + kind_of(camera) +
                  ": a Camera, or the name of a preset or file is expected",
              "Slam", "give the camera of a source, or make one with stillmap.Camera(...)");
}

std::unique_ptr<PythonSlam> make_slam(const py::object& camera, const py::object& options,
                                      const std::string& preset, bool masks,
                                      const std::optional<std::filesystem::path>& load_map,
                                      bool extend_map, const py::kwargs& groups) {
  const Camera chosen = camera_named(camera);
  const Options all = options_of(options, preset, groups);
  if (masks && !(all.network.model.empty() && all.network.masks.empty())) {
    throw Error("masks are expected in addition to network.model or network.masks", "Slam",
                "choose one of them");
  }
  std::optional<StartMap> start;
  if (load_map) start = StartMap{*load_map, extend_map};
  const py::gil_scoped_release release;
  return std::make_unique<PythonSlam>(chosen, all, masks, start);
}

std::optional<LentImage> mask_of(const py::object& mask) {
  if (mask.is_none()) return std::nullopt;
  return LentImage::mask(mask);
}

std::optional<LentImage> depth_of(const py::object& depth) {
  if (depth.is_none()) return std::nullopt;
  return LentImage::depth(depth);
}

void require_seconds(double stamp) {
  if (!(stamp > kLatestStamp)) return;
  throw Error("the stamp is " + std::string(py::str(py::float_(stamp))) + ": seconds are expected",
              kPush, "divide nanoseconds by 1e9, microseconds by 1e6, milliseconds by 1e3");
}

PoseUpdate push_images(PythonSlam& slam, const py::object& rgb, const py::object& depth,
                       double stamp, const py::object& mask) {
  require_seconds(stamp);
  const LentImage color = LentImage::color(rgb);
  const std::optional<LentImage> depths = depth_of(depth), lent_mask = mask_of(mask);
  const py::gil_scoped_release release;
  return slam.push(color, depths, stamp, lent_mask);
}

PoseUpdate push_frame(PythonSlam& slam, const Frame& frame, const py::object& mask) {
  const std::optional<LentImage> lent_mask = mask_of(mask);
  const py::gil_scoped_release release;
  return slam.push(frame, lent_mask);
}

PoseUpdate push_stereo(PythonSlam& slam, const py::object& left, const py::object& right,
                       double stamp, const py::object& mask) {
  require_seconds(stamp);
  const LentImage lent_left = LentImage::color(left), lent_right = LentImage::color(right);
  const std::optional<LentImage> lent_mask = mask_of(mask);
  const py::gil_scoped_release release;
  return slam.push_stereo(lent_left, lent_right, stamp, lent_mask);
}

void set_mode(PythonSlam& slam, const std::string& mode) {
  if (mode != "map" && mode != "localize") {
    throw Error("there is no mode '" + mode + "'", "set_mode", R"(give "map" or "localize")");
  }
  const py::gil_scoped_release release;
  slam.set_mode(mode == "map" ? Mode::kMap : Mode::kLocalize);
}

Signature slam_signature() {
  return {.function = "Slam",
          .parameters = {{"camera", "a Camera, or the name of a preset or file", fits_any},
                         {"options", "a dict, or Options", fits_any, false},
                         {"preset", "a name of presets()", fits<std::string>, false},
                         {"masks", "True or False", fits<bool>, false},
                         {"load_map", "the name of a file",
                          fits<std::optional<std::filesystem::path>>, false},
                         {"extend_map", "True or False", fits<bool>, false}},
          .positional = 2,
          .fix =
              "call Slam(camera, options), with the keywords preset, masks, load_map and "
              "extend_map as needed",
          .groups = true};
}

/// Throws Error for a call of push() that fits neither form.
void refuse_push(const PythonSlam&, const py::args& args, const py::kwargs& keywords) {
  const Parameter mask{"mask", "an array", fits_any, false};
  const std::string fix =
      "call push(frame), push(frame, mask), push(rgb, depth, stamp) or push(rgb, depth, stamp, "
      "mask); depth may be None";
  const bool is_frame =
      keywords.contains("frame") || (!args.empty() && py::isinstance<Frame>(args[0]));
  if (is_frame) {
    refuse_call({kPush, {{"frame", "a Frame of a source", fits<Frame>}, mask}, 2, fix}, args,
                keywords);
  }
  const Parameter stamp{"stamp", "the time of the color image in seconds", fits<double>, true,
                        "give a number, such as stamp.timestamp() of a datetime"};
  refuse_call(
      {kPush,
       {{"rgb", "an array", fits_any}, {"depth", "an array or None", fits_any}, stamp, mask},
       4,
       fix},
      args, keywords);
}

std::shared_ptr<Snapshot> snapshot_of(const PythonSlam& slam) {
  const py::gil_scoped_release release;
  return std::const_pointer_cast<Snapshot>(slam.snapshot());  // nothing in it can be assigned
}

std::shared_ptr<Results> results_of(const PythonSlam& slam) {
  const py::gil_scoped_release release;
  return slam.results();
}

/// Returns a property of the results; before finish() that of a snapshot.
template <const char* name>
py::object newest(const PythonSlam& slam) {
  const std::shared_ptr<Results> results = results_of(slam);
  return results ? py::cast(results).attr(name) : py::cast(snapshot_of(slam)).attr(name);
}
constexpr char kTrajectory[] = "trajectory", kCloud[] = "cloud";

}  // namespace

void bind_slam(py::module_& module) {
  using WithoutGil = py::call_guard<py::gil_scoped_release>;
  py::class_<PythonSlam>(
      module, "Slam",
      "RGB-D SLAM for dynamic scenes. The world frame is the camera frame of the first frame (x "
      "right, y down, z ahead) [m]. All methods may be called by any thread; calls of push() wait "
      "for each other.")
      .def(py::init(&make_slam), py::arg("camera"), py::arg("options") = py::none(), py::kw_only(),
           py::arg("preset") = "", py::arg("masks") = false, py::arg("load_map") = py::none(),
           py::arg("extend_map") = true,
           "camera: Camera, or a preset or file for Camera.read(). options: Options, or a dict of "
           "the command's option names; groups of options also as keywords, network={\"model\": "
           "FILE}. preset: such as \"orb-rgbd\". masks: whether masks are pushed with the frames. "
           "load_map: saved map of this camera to start from; extend_map=False only localizes the "
           "camera in it.")
      .def(py::init(
               [](const py::args& args, const py::kwargs& keywords) -> std::unique_ptr<PythonSlam> {
                 refuse_call(slam_signature(), args, keywords);
               }),
           "Any other call raises stillmap.Error, which names the argument.")
      .def("keep_journal", &PythonSlam::keep_journal, py::arg("file"), WithoutGil(),
           "Keeps the results so far in a file from now on, so that a process that is killed loses "
           "at most its last second: `stillmap recover FILE` and load_map read it. The file stays "
           "after finish(). Called once, before finish().")
      .def("push", &push_frame, py::arg("frame"), py::arg("mask") = py::none(),
           "Tracks a frame of a source. Returns as the other form does.")
      .def("push", &push_images, py::arg("rgb"), py::arg("depth"), py::arg("stamp"),
           py::arg("mask") = py::none(),
           "Tracks a frame. Returns its PoseUpdate. rgb: H x W x 3 uint8 RGB, or H x W gray; "
           "depth: H x W, uint16 "
           "in units of 1 / camera.depth_factor meters or float32 [m], registered to the color "
           "image; 0 or NaN where unknown, None without a depth image; stamp: time of the color "
           "image [s], rising; mask: H x W "
           "uint8 or bool; 0 static, 255 person, other values another moving object. The GIL is "
           "released; the arrays must not be changed until push() returns, and are not used "
           "afterwards.")
      .def("push", &refuse_push, "Any other call raises stillmap.Error, which names the argument.")
      .def("push_stereo", &push_stereo, py::arg("left"), py::arg("right"), py::arg("stamp"),
           py::arg("mask") = py::none(),
           "Tracks a rectified stereo pair: the left image, with depth by semi-global matching. "
           "Images, stamp and mask as push(); the camera has sensor=\"stereo\" and the baseline of "
           "the pair.")
      .def("push_imu", &PythonSlam::push_imu, py::arg("stamp"), py::arg("angular_velocity"),
           py::arg("linear_acceleration"), WithoutGil(),
           "Adds a sample of the camera's IMU (Camera.imu), before the frames that are taken after "
           "it. stamp [s]; angular_velocity: x y z [rad/s]; linear_acceleration: x y z with "
           "gravity [m/s^2].")
      .def("push_odometry", &PythonSlam::push_odometry, py::arg("stamp"), py::arg("T_odom_base"),
           WithoutGil(),
           "Adds a sample of the odometry of the robot that carries the camera "
           "(Camera.T_camera_base), before the frames that are taken after it. stamp [s]; "
           "T_odom_base: pose of the base, 4 x 4.")
      .def("snapshot", &snapshot_of, "State of the system (Snapshot), at any time.")
      .def_property_readonly("trajectory", &newest<kTrajectory>,
                             "Trajectory of the results, or of a snapshot before finish().")
      .def_property_readonly("cloud", &newest<kCloud>,
                             "Cloud of the results, or of a snapshot before finish().")
      .def_property_readonly(
          "movers", py::cpp_function(&PythonSlam::movers, WithoutGil()),
          "Moving objects in the newest frame (Mover), as in a snapshot. The tracks of the whole "
          "run (MoverTrack) are in the results.")
      .def_property_readonly(
          "newest", py::cpp_function(&PythonSlam::newest, WithoutGil()),
          "What the tracker saw in the newest frame (ObservedFrame); None before the first.")
      .def(
          "set_mode", &set_mode, py::arg("mode"),
          "\"map\": the frames pushed from now on extend the map; \"localize\": the camera is only "
          "localized in it, and it stays as it is.")
      .def("load_map", &PythonSlam::load_map, py::arg("file"), WithoutGil(),
           "Adds a saved map while the system runs: a lost camera is relocalized in it, and the "
           "present map is merged into it when a keyframe, an earlier one included, shows a place "
           "of it; the world is then that of the added map. Returns why no place is recognized "
           "yet; an empty text if the maps are merged.")
      .def("watch", &PythonSlam::watch, py::arg("rules"), WithoutGil(),
           "Evaluates the zones and distances of a file (docs/view.md) in each frame from now on.")
      .def_property_readonly("warnings", py::cpp_function(&PythonSlam::warnings, WithoutGil()),
                             "Warnings (WarningEvent) that are present in the newest frame; none "
                             "without watch().")
      .def("changes", &PythonSlam::changes, WithoutGil(),
           "What changed since the saved map was made (ObjectChange), as far as the frames that "
           "extend it show it, the largest object first. Computes for about a second; before "
           "finish() only.")
      .def_property_readonly("findings", py::cpp_function(&PythonSlam::findings, WithoutGil()),
                             "Findings of the results; before finish() what the frames pushed so "
                             "far show to be wrong, such as a wrong depth factor.")
      .def("finish", &PythonSlam::finish, WithoutGil(),
           "Waits for all threads, applies global bundle adjustment and returns the Results; "
           "a second call returns the same. No frame may be pushed afterwards.")
      .def("save_map", &PythonSlam::save_map, py::arg("file"), WithoutGil(),
           "Saves the map for load_map, at any time; before finish() without the final "
           "adjustment.");
}

}  // namespace stillmap::python
