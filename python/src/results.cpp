// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/report/run_record.hpp"
#include "stillmap/write_results.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "bindings.hpp"

namespace stillmap::python {
namespace {

namespace py = pybind11;
using CloudPtr = std::shared_ptr<Cloud>;

py::object vector_of(const Eigen::Vector3d& v) { return array_of({v.x(), v.y(), v.z()}, {3}); }

py::object points_of(const CloudPtr& cloud) {
  constexpr py::ssize_t kItem = sizeof(float), kPoint = sizeof(Eigen::Vector3f);
  static_assert(kPoint == 3 * kItem);
  const auto count = static_cast<py::ssize_t>(cloud->size());
  static const Eigen::Vector3f kNone = Eigen::Vector3f::Zero();
  const void* data = cloud->empty() ? &kNone : cloud->points.data();
  return array_of(Memory{cloud, data, "f", kItem, {count, 3}, {kPoint, kItem}});
}

py::object colors_of(const CloudPtr& cloud) {
  static_assert(sizeof(Rgb) == 3);
  const auto count = static_cast<py::ssize_t>(cloud->size());
  static const Rgb kNone = {};
  const void* data = cloud->empty() ? &kNone : cloud->colors.data();
  return array_of(Memory{cloud, data, "B", 1, {count, 3}, {3, 1}});
}

/// Python's types know no const; nothing writes to a cloud, whose arrays are read-only.
CloudPtr mutable_cloud(const std::shared_ptr<const Cloud>& cloud) {
  return std::const_pointer_cast<Cloud>(cloud);
}

/// Returns the covariances of poses, N x 6 x 6.
py::object covariances_of(const std::vector<UncertainPose>& poses) {
  std::vector<double> values;
  for (const UncertainPose& pose : poses)
    values.insert(values.end(), pose.covariance.data(), pose.covariance.data() + 36);
  return array_of(std::move(values), {static_cast<py::ssize_t>(poses.size()), 6, 6});
}

/// Returns the lower and the upper corner of a box; None without one.
py::object corners_of(const std::optional<Eigen::AlignedBox3d>& box) {
  if (!box) return py::none();
  const Eigen::Vector3d &a = box->min(), &b = box->max();
  return array_of({a.x(), a.y(), a.z(), b.x(), b.y(), b.z()}, {2, 3});
}

const char* state_name(PoseState state) {
  switch (state) {
    case PoseState::kTracked:
      return "tracked";
    case PoseState::kNoMap:
      return "no map";
    case PoseState::kLost:
      return "lost";
    case PoseState::kPredicted:
      return "predicted";
    case PoseState::kSkipped:
      break;
  }
  return "skipped";
}

py::object matrix_or_none(const std::optional<Pose>& pose) {
  if (!pose) return py::none();
  return matrix_of(*pose);
}

Trajectory keyframes_of(const Snapshot& snapshot) {
  Trajectory trajectory;
  for (const KeyframePose& k : snapshot.keyframes)
    trajectory.push_back({k.timestamp, k.T_world_camera});
  return trajectory;
}

py::object landmarks_of(const Snapshot& snapshot) {
  std::vector<double> values;
  for (const LandmarkPoint& l : snapshot.landmarks)
    values.insert(values.end(), {l.p_world.x(), l.p_world.y(), l.p_world.z()});
  return array_of(std::move(values), {static_cast<py::ssize_t>(snapshot.landmarks.size()), 3});
}

py::object voxels_of(const Snapshot& snapshot) {
  constexpr py::ssize_t kItem = sizeof(std::uint64_t);
  static constexpr std::uint64_t kNone = 0;  // an address even of no element
  const std::vector<std::uint64_t>& voxels = *snapshot.cloud_voxels;
  return array_of(Memory{snapshot.cloud_voxels,
                         voxels.empty() ? &kNone : voxels.data(),
                         py::format_descriptor<std::uint64_t>::format(),
                         kItem,
                         {static_cast<py::ssize_t>(voxels.size())},
                         {kItem}});
}

py::object static_probabilities_of(const Snapshot& snapshot) {
  std::vector<double> values;
  for (const LandmarkPoint& l : snapshot.landmarks) values.push_back(l.static_probability);
  return array_of(std::move(values), {static_cast<py::ssize_t>(snapshot.landmarks.size())});
}

py::dict statistics_of(const RunStatistics& s) {
  using namespace py::literals;
  return py::dict("frames"_a = s.frames, "tracked"_a = s.tracked, "segmented"_a = s.segmented,
                  "maps"_a = s.maps, "landmarks"_a = s.landmarks,
                  "tracking_median_ms"_a = s.tracking_median_ms);
}

void bind_cloud(py::module_& module) {
  py::class_<Cloud, CloudPtr>(module, "Cloud",
                              "A colored point cloud. Its arrays are read-only views, not copies.")
      .def_property_readonly("points", &points_of, "Points, N x 3 float32 [m], world frame.")
      .def_property_readonly("colors", &colors_of, "Colors, N x 3 uint8 RGB.")
      .def("__len__", &Cloud::size)
      .def(
          "write",
          [](const Cloud& cloud, const std::filesystem::path& file) { write_ply(file, cloud); },
          py::arg("file"), py::call_guard<py::gil_scoped_release>(), "Writes a binary PLY file.");
  module.def(
      "read_ply",
      [](const std::filesystem::path& file) { return std::make_shared<Cloud>(read_ply(file)); },
      py::arg("file"), py::call_guard<py::gil_scoped_release>(), "Reads the points of a PLY file.");
}

using GridPtr = std::shared_ptr<NavigationGrid>;

GridPtr grid_of(const Cloud& cloud, const MatrixOrNumbers& T_map_world,
                const std::vector<Eigen::Vector3d>& way, const NavigationGridOptions& options) {
  auto grid = navigation_grid(cloud, way, motion_of(T_map_world, "T_map_world"), options);
  return grid ? std::make_shared<NavigationGrid>(std::move(*grid)) : nullptr;
}

void bind_navigation_grid(py::module_& module) {
  using Positions = std::vector<std::array<double, 3>>;
  py::class_<NavigationGrid, GridPtr>(
      module, "NavigationGrid",
      "A grid for planners on the floor. Cell [row, column] begins at origin + cell * (column, "
      "row). Its arrays are read-only views.")
      .def_readonly("cell", &NavigationGrid::cell, "Side of a cell [m].")
      .def_property_readonly(
          "origin",
          [](const NavigationGrid& grid) { return std::pair(grid.origin.x(), grid.origin.y()); },
          "(x, y) [m], frame map.")
      .def_property_readonly(
          "cells", [](const GridPtr& grid) { return view_of(grid->cells, grid); },
          "Rows x columns int8: 0 free, 100 occupied, -1 unknown, as in nav_msgs/OccupancyGrid.")
      .def_property_readonly(
          "distances", [](const GridPtr& grid) { return view_of(grid->distances, grid); },
          "Rows x columns float32: distance from the nearest occupied cell [m].")
      .def(
          "distance_at",
          [](const NavigationGrid& grid, double x, double y) {
            return grid.distance_at({x, y});
          },
          py::arg("x"), py::arg("y"), "Distance at a position, interpolated [m]; None outside.");
  module.def(
      "navigation_grid",
      [](const Cloud& cloud, const MatrixOrNumbers& T_map_world, const Positions& way, double cell,
         double lowest, double highest, double radius) {
        std::vector<Eigen::Vector3d> positions;
        for (const auto& [x, y, z] : way) positions.emplace_back(x, y, z);
        return grid_of(cloud, T_map_world, positions, {cell, lowest, highest, radius});
      },
      py::arg("cloud"), py::arg("T_map_world"), py::kw_only(), py::arg("way") = Positions(),
      py::arg("cell") = NavigationGridOptions().cell,
      py::arg("lowest") = NavigationGridOptions().lowest,
      py::arg("highest") = NavigationGridOptions().highest,
      py::arg("radius") = NavigationGridOptions().radius, py::call_guard<py::gil_scoped_release>(),
      "The grid of static surfaces, such as Snapshot.cloud during a run, for planners. A cell is "
      "occupied if surfaces are in it between the heights lowest and highest above the floor [m]; "
      "otherwise it is free if floor was seen in it, or if it is within radius of the way of the "
      "robot's base, N x 3 in the world frame. T_map_world: z upwards, the floor at z = 0; a 4 x 4 "
      "matrix, or the seven numbers of floor.json. None "
      "without surfaces and way.");
}

using FieldPtr = std::shared_ptr<DistanceField>;

py::object distances_of(const FieldPtr& field) {
  constexpr py::ssize_t kItem = sizeof(float);
  const auto count = [&](int axis) { return static_cast<py::ssize_t>(field->size[axis]); };
  return array_of(Memory{field,
                         field->distances.data(),
                         py::format_descriptor<float>::format(),
                         kItem,
                         {count(0), count(1), count(2)},
                         {count(1) * count(2) * kItem, count(2) * kItem, kItem}});
}

void bind_distance_field(py::module_& module) {
  const auto vector = [](const Eigen::Vector3d& v) { return array_of({v.x(), v.y(), v.z()}, {3}); };
  const auto at = [](double x, double y, double z) { return Eigen::Vector3d(x, y, z); };
  py::class_<DistanceField, FieldPtr>(
      module, "DistanceField",
      "Distances from static surfaces in space (ESDF). Cell [x, y, z] begins at origin + cell * "
      "(x, y, z), world frame.")
      .def_readonly("cell", &DistanceField::cell, "Side of a cell [m].")
      .def_property_readonly(
          "origin", [=](const DistanceField& field) { return vector(field.origin); }, "[m]")
      .def_property_readonly("distances", &distances_of,
                             "float32 by x, y, z: distance of a cell from the nearest one with a "
                             "surface [m]; a read-only view.")
      .def(
          "distance_at",
          [=](const DistanceField& field, double x, double y, double z) {
            return field.distance_at(at(x, y, z));
          },
          py::arg("x"), py::arg("y"), py::arg("z"),
          "Distance at a position, interpolated [m]; None outside.")
      .def(
          "gradient_at",
          [=](const DistanceField& field, double x, double y, double z) -> py::object {
            const auto gradient = field.gradient_at(at(x, y, z));
            return gradient ? vector(*gradient) : py::none();
          },
          py::arg("x"), py::arg("y"), py::arg("z"),
          "Change of the distance, away from the nearest surface; None outside.");
  module.def(
      "distance_field",
      [](const Cloud& cloud, double cell, double margin) -> FieldPtr {
        auto field = distance_field(cloud, cell, margin);
        return field ? std::make_shared<DistanceField>(std::move(*field)) : nullptr;
      },
      py::arg("cloud"), py::kw_only(), py::arg("cell") = 0.1, py::arg("margin") = 0.5,
      py::call_guard<py::gil_scoped_release>(),
      "Distances from the surfaces of a cloud, such as Snapshot.cloud during a run, in cells of "
      "some side and up to a margin around it [m]. None without points.");
}

void bind_movers(py::module_& module) {
  py::class_<MovingObject>(module, "Mover", "A moving object at one time, in the world frame.")
      .def_readonly("id", &MovingObject::id, "1, 2, 3 ... in the order of appearance.")
      .def_readonly("class_name", &MovingObject::class_name, "\"unknown\" without a known class.")
      .def_readonly("stamp", &MovingObject::timestamp, "Time of the frame [s].")
      .def_readonly("observed", &MovingObject::observed,
                    "Whether it was observed in this frame, not predicted.")
      .def_property_readonly(
          "centroid", [](const MovingObject& m) { return vector_of(m.centroid); },
          "Position, 3 float64 [m].")
      .def_property_readonly(
          "velocity", [](const MovingObject& m) { return vector_of(m.velocity); },
          "Velocity, 3 float64 [m/s].")
      .def_property_readonly(
          "box", [](const MovingObject& m) { return corners_of(m.box); },
          "Lower and upper corner, 2x3 float64 [m].")
      .def("__repr__", [](const MovingObject& m) {
        return "stillmap.Mover(" + std::to_string(m.id) + ", '" + m.class_name + "')";
      });
  py::class_<WarningEvent>(module, "WarningEvent", "A warning of the rules of Slam.watch().")
      .def_property_readonly(
          "kind", [](const WarningEvent& w) { return name_of(w.kind); },
          R"("zone", "near", "course", "unseen" or "unknown".)")
      .def_readonly("id", &WarningEvent::id, "Running number from 1.")
      .def_readonly("rule", &WarningEvent::rule,
                    "Name of the zone or distance, or the reason of \"unknown\".")
      .def_readonly("mover", &WarningEvent::mover, "Id of the moving object; 0: none.")
      .def_readonly("class_name", &WarningEvent::class_name, "Of the moving object.")
      .def_readonly("distance", &WarningEvent::distance,
                    "From the point of the rule, or the nearest predicted one; 0 for zones [m].")
      .def_readonly("seconds", &WarningEvent::seconds,
                    "Time until the nearest predicted distance [s].")
      .def_readonly("stamp", &WarningEvent::timestamp, "Time of the frame [s].")
      .def_property_readonly(
          "position", [](const WarningEvent& w) { return vector_of(w.position); },
          "Of the moving object, in the world frame, 3 float64 [m].")
      .def("__str__", [](const WarningEvent& w) { return warning_text(w); });
  py::class_<ObjectChange>(module, "ObjectChange",
                           "An object that appeared, went or moved since the saved map was made.")
      .def_readonly("class_name", &ObjectChange::class_name, "\"unknown\" without a known class.")
      .def_property_readonly(
          "before", [](const ObjectChange& c) { return corners_of(c.before); },
          "Lower and upper corner in the saved map, 2x3 float64 [m]; None: it appeared.")
      .def_property_readonly(
          "after", [](const ObjectChange& c) { return corners_of(c.after); },
          "Present lower and upper corner, 2x3 float64 [m]; None: it went.")
      .def("__repr__", [](const ObjectChange& c) {
        const char* kind = !c.before ? "appeared" : !c.after ? "went" : "moved";
        return "<stillmap.ObjectChange: " + c.class_name + " " + kind + ">";
      });
  py::class_<MovingObjectTrack>(module, "MoverTrack", "A moving object over the whole run.")
      .def_readonly("id", &MovingObjectTrack::id)
      .def_readonly("class_name", &MovingObjectTrack::class_name)
      .def_readonly("class_confidence", &MovingObjectTrack::class_confidence,
                    "Mean confidence of its detections [0..1].")
      .def_readonly("samples", &MovingObjectTrack::samples,
                    "A Mover per frame from the first to the last detection.");
}

using ObservedPtr = std::shared_ptr<ObservedFrame>;

/// Returns a view of a member of all keypoints.
/// @param format  its type, as in Python's module struct
/// @param width   number of values from it on that are shown; 0: one without a dimension of its own
template <typename T>
py::object keypoint_view(const ObservedPtr& frame, T ObservedKeypoint::*member,
                         const std::string& format, py::ssize_t width = 0) {
  constexpr py::ssize_t kItem = sizeof(T), kStep = sizeof(ObservedKeypoint);
  static const ObservedKeypoint kNone;
  const auto count = static_cast<py::ssize_t>(frame->keypoints.size());
  const ObservedKeypoint& first = count == 0 ? kNone : frame->keypoints.front();
  Memory memory{frame, &(first.*member), format, kItem, {count}, {kStep}};
  if (width > 0) {
    memory.shape.push_back(width);
    memory.strides.push_back(kItem);
  }
  return array_of(std::move(memory));
}

py::list objects_of(const ObservedFrame& frame) {
  py::list objects;
  if (!frame.objects) return objects;
  for (const Instance& object : frame.objects->instances) objects.append(object);
  return objects;
}

py::object image_or_none(const cv::Mat& image) {
  if (image.empty()) return py::none();
  return view_of(image, std::make_shared<cv::Mat>(image));
}

void bind_observations(py::module_& module) {
  py::class_<Instance>(module, "DetectedObject", "An object of the network or the masks.")
      .def_readonly("class_name", &Instance::class_name)
      .def_readonly("confidence", &Instance::confidence, "[0..1]")
      .def_property_readonly(
          "box",
          [](const Instance& object) {
            const cv::Rect& box = object.box;
            return py::make_tuple(box.x, box.y, box.width, box.height);
          },
          "Left, top, width, height [pixels].")
      .def_property_readonly(
          "mask", [](const Instance& object) { return image_or_none(object.mask); },
          "255 on the object, uint8 of the box's size; None if only the box is known.");
  py::class_<ObservedFrame, ObservedPtr>(
      module, "ObservedFrame",
      "What the tracker saw in a frame: images, keypoints with motion labels, objects. Its arrays "
      "are read-only views.")
      .def_readonly("update", &ObservedFrame::update, "Result of the frame (PoseUpdate).")
      .def_property_readonly(
          "rgb", [](const ObservedPtr& f) { return view_of(f->images->color, f->images); },
          "H x W x 3 uint8, as tracked: rectified, and halved if the options say so.")
      .def_property_readonly(
          "depth", [](const ObservedPtr& f) { return view_of(f->images->depth, f->images); },
          "H x W float32 [m]; 0 where unknown.")
      .def_property_readonly(
          "keypoints",
          [](const ObservedPtr& f) { return keypoint_view(f, &ObservedKeypoint::u, "f", 3); },
          "N x 3 float32: u, v [pixels], depth [m; 0: unknown].")
      .def_property_readonly(
          "static_probabilities",
          [](const ObservedPtr& f) {
            return keypoint_view(f, &ObservedKeypoint::static_probability, "f");
          },
          "Probability of each keypoint that its surface is static, N float32 [0..1].")
      .def_property_readonly(
          "moving",
          [](const ObservedPtr& f) { return keypoint_view(f, &ObservedKeypoint::moving, "?"); },
          "Whether each keypoint is labeled as moving, N bool.")
      .def_property_readonly(
          "matched",
          [](const ObservedPtr& f) { return keypoint_view(f, &ObservedKeypoint::matched, "?"); },
          "Whether each keypoint is matched with a landmark, N bool.")
      .def_property_readonly("objects", &objects_of, "Detected objects (DetectedObject).")
      .def_property_readonly(
          "mask_age",
          [](const ObservedFrame& f) -> py::object {
            return f.objects ? py::cast(f.objects->age()) : py::none();
          },
          "Age of the objects' masks [frames]; None without a result of a network or masks.")
      .def_property_readonly(
          "moving_mask", [](const ObservedFrame& f) { return image_or_none(f.moving); },
          "255 at pixels labeled as moving, H x W uint8; None if there are none.");
}

void bind_updates(py::module_& module) {
  py::class_<PoseUpdate>(module, "PoseUpdate", "The tracking result of one frame.")
      .def_readonly("index", &PoseUpdate::frame_index)
      .def_readonly("stamp", &PoseUpdate::timestamp, "Time of the frame [s].")
      .def_property_readonly(
          "state", [](const PoseUpdate& u) { return state_name(u.state); },
          "'tracked'; without a pose 'no map' yet, 'lost', or 'skipped' by the options.")
      .def_property_readonly(
          "T_world_camera", [](const PoseUpdate& u) { return matrix_or_none(u.T_world_camera); },
          "Pose, 4x4 float64 [m]; or None.")
      .def_property_readonly(
          "T_previous_camera",
          [](const PoseUpdate& u) { return matrix_or_none(u.T_previous_camera); },
          "Motion since the previous frame, 4x4 float64 [m], without the filter and corrections of "
          "the map: visual odometry. None in a snapshot, and where poses do not continue.")
      .def_readonly("reason", &PoseUpdate::reason,
                    "Reason why there is no pose, and why the place of a lost camera is not found; "
                    "empty if there is one.")
      .def_readonly("inliers", &PoseUpdate::inliers, "Landmarks that agree with the pose.")
      .def_readonly("relocalized", &PoseUpdate::relocalized)
      .def_readonly(
          "in_saved_map", &PoseUpdate::in_saved_map,
          "Whether T_world_camera is in the world of the saved map loaded last; False until "
          "the camera is relocalized in it or the present map is merged into it.")
      .def_readonly("certain", &PoseUpdate::certain,
                    "False if the pose contradicts the motion of the camera before.")
      .def_property_readonly(
          "covariance",
          [](const PoseUpdate& u) {
            return array_of({u.covariance.data(), u.covariance.data() + 36}, {6, 6});
          },
          "Covariance of the perturbation (v, w) in the camera frame, 6x6 [m^2, m rad, rad^2].");
  py::class_<MapEvent>(module, "MapEvent", "A loop closed, two maps merged, or a map dropped.")
      .def_property_readonly(
          "kind", [](const MapEvent& e) { return name_of(e.kind); }, "loop, merge or dropped.")
      .def_readonly("index", &MapEvent::frame_index)
      .def_readonly("stamp", &MapEvent::timestamp, "[s]")
      .def_readonly("meters", &MapEvent::meters, "Correction of the camera's position [m].")
      .def_readonly("radians", &MapEvent::radians, "Correction of its rotation [rad].");
}

void bind_snapshot(py::module_& module) {
  using Class = py::class_<Snapshot, std::shared_ptr<Snapshot>>;
  Class(module, "Snapshot", "The state of the system at one time. It does not change.")
      .def_readonly("newest", &Snapshot::newest, "Result of the frame pushed last (PoseUpdate).")
      .def_property_readonly(
          "trajectory", [](const Snapshot& s) { return rows_of(s.trajectory); },
          "Poses in the current map, N x 8: stamp [s], translation [m], quaternion x y z w.")
      .def_property_readonly(
          "keyframes", [](const Snapshot& s) { return rows_of(keyframes_of(s)); },
          "Poses of the keyframes, N x 8.")
      .def_property_readonly("landmarks", &landmarks_of, "Positions, N x 3 float64 [m].")
      .def_property_readonly("static_probabilities", &static_probabilities_of,
                             "Probability of each landmark that it is static, N float64 [0..1].")
      .def_readonly("events", &Snapshot::events)
      .def_readonly("movers", &Snapshot::movers, "Moving objects in order of their ids.")
      .def_property_readonly(
          "cloud", [](const Snapshot& s) { return mutable_cloud(s.cloud); },
          "Static surfaces, coarser than the final cloud while frames are pushed.")
      .def_property_readonly("cloud_voxels", &voxels_of,
                             "Number of the voxel of each point of the cloud, N uint64: the same "
                             "voxel has the same number in all snapshots; empty after finish().");
}

}  // namespace

void bind_results(py::module_& module) {
  bind_cloud(module);
  bind_navigation_grid(module);
  bind_distance_field(module);
  bind_movers(module);
  bind_updates(module);
  bind_observations(module);
  bind_snapshot(module);
  py::class_<Finding>(module, "Finding", "Something about a recording or a result.")
      .def_readonly("code", &Finding::code, "Code of docs/findings.md, such as 'depth-factor'.")
      .def_property_readonly(
          "severity", [](const Finding& finding) { return name_of(finding.severity); },
          "'note', 'warning', or 'untrusted': the result is probably wrong.")
      .def_readonly("message", &Finding::message, "One sentence.")
      .def_readonly("fix", &Finding::fix, "What to do about it; empty: nothing.")
      .def_readonly("evidence", &Finding::evidence, "Numbers by name; the unit ends the name.")
      .def("__repr__", [](const Finding& finding) {
        return fmt::format("<Finding {}: {}>", finding.code, finding.text());
      });

  py::class_<Results, std::shared_ptr<Results>>(module, "Results", "All results of a run.")
      .def_property_readonly(
          "trajectory", [](const Results& r) { return rows_of(r.trajectory); },
          "T_world_camera of every frame with a pose, N x 8: stamp [s], translation [m], "
          "quaternion x y z w.")
      .def_property_readonly(
          "covariances", [](const Results& r) { return covariances_of(r.poses); },
          "Covariances of the poses, N x 6 x 6 [m^2, m rad, rad^2]; see PoseUpdate.covariance.")
      .def_property_readonly(
          "keyframes", [](const Results& r) { return rows_of(r.keyframes); },
          "Poses of the keyframes, N x 8.")
      .def_property_readonly(
          "cloud", [](const Results& r) { return mutable_cloud(r.cloud); },
          "Static cloud in the world frame.")
      .def_readonly("movers", &Results::movers, "Moving objects (MoverTrack).")
      .def_readonly("events", &Results::events)
      .def_property_readonly(
          "statistics", [](const Results& r) { return statistics_of(r.statistics); },
          "frames, tracked, segmented, maps, landmarks, tracking_median_ms [ms].")
      .def_readonly("findings", &Results::findings,
                    "What the frames and the map show to be wrong or worth knowing (Finding).")
      .def(
          "write",
          [](const Results& results, const std::filesystem::path& folder,
             const std::string& title) { return write_results(results, folder, title); },
          py::arg("folder"), py::arg("title") = "", py::call_guard<py::gil_scoped_release>(),
          "Writes the folder that `stillmap run --out` writes; returns the files.");
}

}  // namespace stillmap::python
