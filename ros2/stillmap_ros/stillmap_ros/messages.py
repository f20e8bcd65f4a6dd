# SPDX-License-Identifier: Apache-2.0
"""Messages from matrices, clouds and movers."""
import array

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, TransformStamped, Vector3
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import ColorRGBA, Header
from stillmap_msgs.msg import Mover, MoverArray, ZoneWarning, ZoneWarningArray
from visualization_msgs.msg import Marker, MarkerArray

from stillmap_ros.transforms import quaternion_of

COLORS = {"person": (1.0, 0.3, 0.1)}
OTHER = (1.0, 0.7, 0.0)  # color of movers of other classes
CHANGED = {"went": (0.8, 0.2, 0.2), "appeared": (0.2, 0.6, 0.2), "moved_from": (0.6, 0.4, 0.7), "moved_to": (0.1, 0.5, 0.7)}
SECONDS_SHOWN = 1  # time for which a marker stays without a new one
PREDICTED, STEP = 4, 0.5  # number and interval of the predicted positions of a mover [s]


def time_of(nanoseconds):
    return Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)


def header_of(nanoseconds, frame):
    return Header(stamp=time_of(nanoseconds), frame_id=frame)


def pose_of(T):
    pose = Pose()
    pose.position.x, pose.position.y, pose.position.z = T[:3, 3].tolist()
    rotation = pose.orientation
    rotation.x, rotation.y, rotation.z, rotation.w = quaternion_of(T[:3, :3])
    return pose


def transform_of(T, nanoseconds, parent, child):
    stamped = TransformStamped(header=header_of(nanoseconds, parent), child_frame_id=child)
    t, q = stamped.transform.translation, stamped.transform.rotation
    t.x, t.y, t.z = T[:3, 3].tolist()
    q.x, q.y, q.z, q.w = quaternion_of(T[:3, :3])
    return stamped


def odometry_of(T, covariance, twist, twist_covariance, nanoseconds, frame, child):
    """twist: (v, w) [m/s, rad/s] in the frame of the child."""
    message = Odometry(header=header_of(nanoseconds, frame), child_frame_id=child)
    message.pose.pose = pose_of(T)
    message.pose.covariance = covariance.ravel()
    linear, angular = message.twist.twist.linear, message.twist.twist.angular
    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z = twist.tolist()
    message.twist.covariance = twist_covariance.ravel()
    return message


def pose_message(T, covariance, nanoseconds, frame):
    message = PoseWithCovarianceStamped(header=header_of(nanoseconds, frame))
    message.pose.pose = pose_of(T)
    message.pose.covariance = covariance.ravel()
    return message


def path_of(poses, nanoseconds, frame):
    """poses: (time [ns], matrix) of each one."""
    path = Path(header=header_of(nanoseconds, frame))
    path.poses = [PoseStamped(header=header_of(time, frame), pose=pose_of(T)) for time, T in poses]
    return path


def bytes_of(values):
    return array.array("B", np.ascontiguousarray(values).tobytes())


def cloud_of(points, colors, nanoseconds, frame):
    """points: N x 3 float32; colors: N x 3 uint8 RGB."""
    packed = np.zeros(len(points), [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    packed["x"], packed["y"], packed["z"] = points.T
    packed["rgb"] = colors.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], np.uint32)
    fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
              for i, name in enumerate(("x", "y", "z", "rgb"))]
    return PointCloud2(header=header_of(nanoseconds, frame), height=1, width=len(points), fields=fields, point_step=16,
                       row_step=16 * len(points), data=bytes_of(packed), is_dense=True)


def points_of(cloud):
    """Returns the points N x 3 of a message of cloud_of()."""
    return np.frombuffer(cloud.data, "<f4").reshape(-1, 4)[:, :3]


def grid_of(grid, nanoseconds, frame):
    message = OccupancyGrid(header=header_of(nanoseconds, frame))
    message.info.map_load_time = message.header.stamp
    message.info.resolution = grid.cell
    message.info.height, message.info.width = grid.cells.shape
    message.info.origin.position.x, message.info.origin.position.y = grid.origin
    message.info.origin.orientation.w = 1.0
    message.data = array.array("b", grid.cells.tobytes())
    return message


def point_of(p):
    return Point(x=float(p[0]), y=float(p[1]), z=float(p[2]))


def box_in_map(corners, T_map_world):
    """Returns the lower and upper corner, along the axes of the map, of a box with these corners in the world [m]."""
    points = np.array(np.meshgrid(*np.transpose(corners))).reshape(3, -1).T @ T_map_world[:3, :3].T + T_map_world[:3, 3]
    return points.min(axis=0), points.max(axis=0)


class MoverInMap:
    """Center, velocity, and lower and upper corner of the box of a mover along the axes of the map [m, m/s]."""

    def __init__(self, mover, T_map_world):
        R, t = T_map_world[:3, :3], T_map_world[:3, 3]
        self.center, self.velocity = R @ mover.centroid + t, R @ mover.velocity
        self.low, self.high = box_in_map(mover.box, T_map_world)


def tracks_of(movers, T_map_world, nanoseconds, frame):
    message = MoverArray(header=header_of(nanoseconds, frame))
    for mover in movers:
        here = MoverInMap(mover, T_map_world)
        message.movers.append(Mover(
            id=mover.id, class_name=mover.class_name, observed=mover.observed, position=point_of(here.center),
            velocity=Vector3(**dict(zip("xyz", here.velocity.tolist()))), box_min=point_of(here.low), box_max=point_of(here.high),
            predicted=[point_of(here.center + (i + 1) * STEP * here.velocity) for i in range(PREDICTED)], predicted_step=STEP))
    return message


def warnings_of(warnings, T_map_world, nanoseconds, frame):
    return ZoneWarningArray(header=header_of(nanoseconds, frame), warnings=[ZoneWarning(
        kind=w.kind, id=w.id, rule=w.rule, mover=w.mover, class_name=w.class_name,
        position=point_of(T_map_world[:3, :3] @ w.position + T_map_world[:3, 3]), distance=w.distance, seconds=w.seconds,
        text=str(w)) for w in warnings])


def _marker(mover, header, kind, namespace):
    marker = Marker(header=header, ns=namespace, id=mover.id, type=kind, action=Marker.ADD)
    marker.lifetime.sec = SECONDS_SHOWN
    r, g, b = COLORS.get(mover.class_name, OTHER)
    marker.color = ColorRGBA(r=r, g=g, b=b, a=0.6 if mover.observed else 0.25)
    marker.pose.orientation.w = 1.0
    return marker


def movers_of(movers, T_map_world, nanoseconds, frame):
    """A box, an arrow to where each mover is in a second, and its class with its speed."""
    header, markers = header_of(nanoseconds, frame), []
    for mover in movers:
        here = MoverInMap(mover, T_map_world)
        box = _marker(mover, header, Marker.CUBE, "movers")
        box.pose.position = point_of((here.low + here.high) / 2)
        box.scale.x, box.scale.y, box.scale.z = np.maximum(here.high - here.low, 0.01).tolist()
        arrow = _marker(mover, header, Marker.ARROW, "velocities")
        arrow.points = [point_of(here.center), point_of(here.center + here.velocity)]
        arrow.scale.x, arrow.scale.y = 0.05, 0.1
        text = _marker(mover, header, Marker.TEXT_VIEW_FACING, "classes")
        text.pose.position = point_of([*here.center[:2], here.high[2] + 0.2])
        text.scale.z, text.color.a = 0.2, 1.0
        text.text = f"{mover.class_name} {np.linalg.norm(here.velocity):.1f} m/s"
        markers += [box, arrow, text]
    return MarkerArray(markers=markers)


def changed_objects_of(changes, T_map_world, nanoseconds, frame):
    """The box of each object that appeared, went or moved, in namespaces of these names, and its class. The markers before
    are removed. Both boxes of one that moved have the same number."""
    header = header_of(nanoseconds, frame)
    markers = [Marker(header=header, action=Marker.DELETEALL)]
    for number, change in enumerate(changes):
        moved = change.before is not None and change.after is not None
        for corners, kind in ((change.before, "moved_from" if moved else "went"),
                              (change.after, "moved_to" if moved else "appeared")):
            if corners is None:
                continue
            low, high = box_in_map(corners, T_map_world)
            r, g, b = CHANGED[kind]
            box = Marker(header=header, ns=kind, id=number, type=Marker.CUBE, action=Marker.ADD,
                         color=ColorRGBA(r=r, g=g, b=b, a=0.5), text=change.class_name)
            box.pose.position, box.pose.orientation.w = point_of((low + high) / 2), 1.0
            box.scale.x, box.scale.y, box.scale.z = (high - low).tolist()
            markers.append(box)
    return MarkerArray(markers=markers)
