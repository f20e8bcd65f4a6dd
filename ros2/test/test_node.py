# SPDX-License-Identifier: Apache-2.0
"""The node on ROS 2 with a camera in another process, and the messages that a robot and Nav2 receive."""
import json
import shutil
import signal

import cv2
import numpy as np
import pytest
from conftest import FRAMES, command, stop
from nav_msgs.srv import GetMap, LoadMap
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from std_srvs.srv import SetBool, Trigger
from stillmap_ros.images import nanoseconds
from stillmap_ros.transforms import inverse, matrix_of, matrix_of_pose, quaternion_of

LOCKSTEP = ("--rate", 0, "--clock")


def matrix_of_message(pose):
    p, q = pose.position, pose.orientation
    return matrix_of_pose(p.x, p.y, p.z, q.x, q.y, q.z, q.w)


def tracked(robot):
    return int(robot.values()[0].get("frames tracked", 0))


def play(processes, robot, recording, *words, **parameters):
    """Maps a recording in lockstep. Returns the node."""
    node = processes.node(schedule="lockstep", use_sim_time=True, **parameters)
    processes.camera(recording, *LOCKSTEP, *words)
    assert robot.spin_until(lambda: tracked(robot) == FRAMES, 60), f"{robot.values()} {node.log.read_text()}"
    return node


def test_in_lockstep_the_files_are_those_of_the_command(processes, robot, recording, tmp_path):
    command("run", recording, "--out", tmp_path / "command")
    node = play(processes, robot, recording, results=tmp_path / "node")
    stop(node)
    for name in ("trajectory.txt", "trajectory_covariance.txt", "cloud.ply", "movers.csv"):
        assert (tmp_path / "node" / name).read_bytes() == (tmp_path / "command" / name).read_bytes(), name


def test_nav2_gets_frames_odometry_covariances_and_a_grid(processes, robot, recording, base_to_camera):
    play(processes, robot, recording)
    assert robot.spin_until(lambda: robot.count("pose") == FRAMES and robot.count("odom") == FRAMES, 5)
    # The chain of frames is complete at every image, and agrees with the pose.
    for message in robot.got["pose"][5:]:
        time, T_map_base = nanoseconds(message.header.stamp), matrix_of_message(message.pose.pose)
        chain = robot.tree.lookup("map", "base_link", time)
        assert chain is not None
        assert np.linalg.norm(chain[:3, 3] - T_map_base[:3, 3]) < 0.02
        covariance = np.reshape(message.pose.covariance, (6, 6))
        np.testing.assert_allclose(covariance, covariance.T, atol=1e-12)
        assert np.linalg.eigvalsh(covariance).min() > 0
        assert message.header.frame_id == "map"
    # The odometry moves on without jumps, and its twist is its motion.
    odometry = [(nanoseconds(m.header.stamp) / 1e9, matrix_of_message(m.pose.pose), m) for m in robot.got["odom"]]
    for (before, a, _), (after, b, message) in zip(odometry, odometry[1:]):
        step = inverse(a) @ b
        assert np.linalg.norm(step[:3, 3]) < 0.05
        linear = message.twist.twist.linear
        np.testing.assert_allclose([linear.x, linear.y, linear.z], step[:3, 3] / (after - before), atol=1e-3)
        assert np.linalg.eigvalsh(np.reshape(message.twist.covariance, (6, 6))).min() > 0
        assert (message.header.frame_id, message.child_frame_id) == ("odom", "base_link")
    # The way of the base agrees with the truth.
    truth = np.loadtxt(recording / "groundtruth.txt")
    T_world_base = [matrix_of_pose(*row[1:]) @ inverse(base_to_camera) for row in truth]
    for message in robot.got["pose"][::10]:
        i = int(np.argmin(np.abs(truth[:, 0] - nanoseconds(message.header.stamp) / 1e9)))
        true = inverse(T_world_base[0]) @ T_world_base[i]
        assert np.linalg.norm(matrix_of_message(message.pose.pose)[:3, 3] - true[:3, 3]) < 0.03


def test_the_grid_lies_on_the_floor_and_has_the_walls_but_not_the_people(processes, robot, recording, base_to_camera, tmp_path):
    node = play(processes, robot, recording, results=tmp_path / "results")
    assert robot.spin_until(lambda: robot.count("map") > 2 and robot.count("cloud") > 2 and robot.count("movers") > 0, 20)
    grid, service = robot.got["map"][-1], robot.call(GetMap, "get_map").map
    assert grid.header.frame_id == service.header.frame_id == "map"
    values = np.reshape(grid.data, (grid.info.height, grid.info.width))
    assert (values == 100).sum() > 50 and (values == 0).sum() > 200 and (values == -1).sum() > 50
    stop(node)
    # The final static cloud in the map's frame: where it has many points at the height of the robot, no cell is free.
    import stillmap
    points = stillmap.read_ply(tmp_path / "results" / "cloud.ply").points @ base_to_camera[:3, :3].T + base_to_camera[:3, 3]
    floor = points[np.abs(points[:, 2]) < 0.2]
    assert abs(np.median(floor[:, 2])) < 0.02
    origin, cell = grid.info.origin.position, grid.info.resolution

    def cells(chosen):
        u, v = np.floor((chosen[:, :2] - [origin.x, origin.y]) / cell).astype(int).T
        inside = (u >= 0) & (v >= 0) & (u < grid.info.width) & (v < grid.info.height)
        counts = np.zeros(values.shape, int)
        np.add.at(counts, (v[inside], u[inside]), 1)
        return counts
    obstacles = cells(points[(points[:, 2] > 0.15) & (points[:, 2] < 1.7)])
    assert (values[obstacles > 60] == 100).mean() > 0.5, "the rest was not seen often enough yet"
    assert (values[obstacles > 60] == 0).mean() < 0.02
    near = np.zeros_like(values, bool)
    known = np.argwhere(obstacles > 0)
    for v, u in np.argwhere(values == 100):
        near[v, u] = np.abs(known - [v, u]).max(axis=1).min() <= 2
    assert near[values == 100].mean() > 0.97, "nothing is where people walked"
    marker = robot.got["movers"][-1].markers
    assert all(m.header.frame_id == "map" for m in marker)


def test_movers_are_tracked_and_warned_of_in_the_frame_of_the_map(processes, robot, recording, tmp_path):
    zones = tmp_path / "zones.yaml"
    zones.write_text("zones: [{name: room, polygon: [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], height: [0, 3]}]")
    play(processes, robot, recording, zones=zones)
    assert robot.spin_until(lambda: any(m.movers for m in robot.got.get("tracks", [])), 10)
    newest = [m for m in robot.got["tracks"] if m.movers][-1]
    assert newest.header.frame_id == "map"
    for mover in newest.movers:
        assert mover.id > 0 and mover.class_name
        assert -0.3 < mover.box_min.z < mover.position.z < mover.box_max.z < 2.5, "on the floor of the map"
        later, v = mover.predicted[1], mover.velocity
        assert abs(later.x - mover.position.x - 2 * mover.predicted_step * v.x) < 1e-6
    assert robot.spin_until(lambda: any(w.kind == "zone" for m in robot.got.get("warnings", []) for w in m.warnings), 10)
    warning = [w for m in robot.got["warnings"] for w in m.warnings if w.kind == "zone"][-1]
    assert warning.rule == "room" and warning.mover > 0 and "is in zone 'room'" in warning.text
    assert 0 < warning.position.z < 2, "in the frame of the map"


def test_changes_of_the_cloud_add_up_to_it(processes, robot, recording):
    from stillmap_ros.messages import points_of
    play(processes, robot, recording)
    robot.spin_until(lambda: False, 2)
    assert robot.count("cloud") == robot.count("cloud_added") == robot.count("cloud_removed") > 2
    count = 0
    for whole, added, removed in zip(robot.got["cloud"], robot.got["cloud_added"], robot.got["cloud_removed"]):
        count += added.width - removed.width
        assert whole.width == count
        assert set(map(tuple, points_of(added))) <= set(map(tuple, points_of(whole)))
    assert count > 1000 and sum(m.width for m in robot.got["cloud_added"][1:]) > 0


def test_a_stereo_pair_gives_poses(processes, robot, recording, base_to_camera):
    play(processes, robot, recording, "--stereo", stereo=True)
    truth = np.loadtxt(recording / "groundtruth.txt")
    T_world_base = [matrix_of_pose(*row[1:]) @ inverse(base_to_camera) for row in truth]
    assert robot.spin_until(lambda: robot.count("pose") == FRAMES, 10)
    for message in robot.got["pose"][::10]:
        i = int(np.argmin(np.abs(truth[:, 0] - nanoseconds(message.header.stamp) / 1e9)))
        true = inverse(T_world_base[0]) @ T_world_base[i]
        assert np.linalg.norm(matrix_of_message(message.pose.pose)[:3, 3] - true[:3, 3]) < 0.05


def test_realtime_drops_no_more_than_it_says(processes, robot, recording):
    node = processes.node()
    processes.camera(recording, "--now")
    assert robot.spin_until(lambda: robot.values()[0].get("state") == "tracked", 30), node.log.read_text()
    assert robot.spin_until(lambda: robot.says("no images for"), 30)
    values, _ = robot.values()
    used = sum(int(values.get(f"frames {name}", 0)) for name in ("tracked", "without a pose", "not used", "dropped"))
    assert used == int(values["frames received"]) == FRAMES
    delays = [arrived - nanoseconds(m.header.stamp) / 1e9 for arrived, m in zip(robot.times["pose"], robot.got["pose"])]
    print(f"delay from stamp to pose: median {1000 * np.median(delays):.0f} ms, p95 {1000 * np.quantile(delays, 0.95):.0f} ms")


def test_a_gyroscope_is_used_and_told_if_it_is_wrong(processes, robot, tmp_path):
    folder = tmp_path / "sequence"
    command("simulate", "--people", 0, "--frames", FRAMES, "--width", 320, "--height", 240, "--camera", "rpy", "--imu", "d435i",
            "--out", folder)
    node = play(processes, robot, folder, "--imu", imu=True, results=tmp_path / "right")
    assert int(robot.values()[0]["samples: imu"]) > 5 * FRAMES
    assert robot.values()[0]["findings"] == ""
    stop(node)
    data = np.loadtxt(folder / "imu0" / "data.csv", delimiter=",")
    data[:, 1:4] *= -1
    np.savetxt(folder / "imu0" / "data.csv", data, delimiter=",", fmt=["%d"] + ["%.9f"] * 6)
    robot.got.clear()
    node = play(processes, robot, folder, "--imu", imu=True, results=tmp_path / "wrong")
    stop(node)
    assert "gyroscope-unlike" in (tmp_path / "wrong" / "summary.json").read_text()


def test_seconds_without_images_are_bridged_by_wheels(processes, robot, tmp_path, base_to_camera):
    folder = tmp_path / "sequence"
    command("simulate", "--people", 0, "--frames", FRAMES, "--width", 320, "--height", 240, "--wheels", "--out", folder)
    dark = sorted((folder / "rgb").iterdir())[20:35]
    for file in dark:
        cv2.imwrite(str(file), np.zeros((240, 320, 3), np.uint8))
    rows = np.loadtxt(folder / "odometry.txt")  # of a base that is the camera
    for row in rows:
        T_odom_base = matrix_of_pose(*row[1:]) @ inverse(base_to_camera)
        row[1:] = [*T_odom_base[:3, 3], *quaternion_of(T_odom_base[:3, :3])]
    np.savetxt(folder / "odometry.txt", rows, fmt="%.9f")
    stop(play(processes, robot, folder, "--wheels", wheels=True, results=tmp_path / "results"))
    assert int(robot.values()[0]["samples: wheels"]) > FRAMES
    frames = json.loads((tmp_path / "results" / "summary.json").read_text())["frames"]
    assert frames["predicted"] >= len(dark) - 2
    assert frames["tracked"] == FRAMES


def test_compressed_topics_and_late_depth(processes, robot, recording):
    node = processes.node(color_transport="compressed", depth_transport="compressed", schedule="lockstep")
    processes.camera(recording, "--compressed", "--late", 0.2, "--rate", 20)
    assert robot.spin_until(lambda: tracked(robot) >= FRAMES - 2, 60), node.log.read_text()


def test_a_missing_transform_is_told_and_the_node_starts_when_it_comes(processes, robot, recording):
    node = processes.node(base_frame="base_footprint")
    processes.camera(recording, "--now", "--repeat", 4)
    assert robot.spin_until(lambda: robot.says("no transform base_footprint -> camera_color_optical_frame"), 30)
    assert not robot.count("pose")
    from stillmap_ros import messages
    from tf2_msgs.msg import TFMessage
    robot.static.publish(TFMessage(transforms=[messages.transform_of(np.eye(4), 0, "base_footprint", "base_link")]))
    assert robot.spin_until(lambda: robot.count("pose") > 3, 20), node.log.read_text()


def test_a_camera_that_is_calibrated_later_is_used_then(processes, robot, recording):
    node = processes.node()
    processes.camera(recording, "--now", "--repeat", 4, "--uncalibrated", 20)
    assert robot.spin_until(lambda: robot.says("camera_info has no focal length"), 30), node.log.read_text()
    assert robot.spin_until(lambda: robot.count("pose") > 3, 20), node.log.read_text()


@pytest.mark.parametrize("wrong", [
    {"map_fiel": "a.map"}, {"zones": "/nowhere"}, {"static_mask": "/nowhere"}, {"base_to_camera": "[0.0,1.0]"}, {"sensor": "foo"},
    {"schedule": "foo"}, {"map_file": "/nowhere/a.map"}, {"map_file": "/tmp"}, {"results": "/dev/null/results"}, {"preset": "foo"},
    {"options": "[a=b]"}, {"pairing": "soon"}, {"publish_odom": 1}, {"grid_cell": 0.0}, {"odom_frame": "map"},
    {"color_transport": "theora"}, {"robot_radius": -1.0}, {"base_to_camera": "[0,0,1.2,0,0,0]"}])
def test_a_wrong_parameter_ends_the_node_with_the_reason(processes, wrong):
    node = processes.node(**wrong)
    assert node.wait(20) == 1
    log = node.log.read_text()
    assert "\nstillmap: " in "\n" + log and "Traceback" not in log
    name, value = next(iter(wrong.items()))
    assert name in log or value.strip("[]") in log


def test_a_map_file_that_cannot_be_read_is_kept(processes, robot, recording, tmp_path):
    map_file = tmp_path / "office.map"
    map_file.write_text("precious")
    stop(play(processes, robot, recording, map_file=map_file))
    assert (tmp_path / "office.map.old").read_text() == "precious"
    assert map_file.stat().st_size > 10000


def test_a_journal_that_cannot_be_read_does_not_cost_the_saved_map(processes, robot, recording, tmp_path):
    map_file = tmp_path / "office.map"
    stop(play(processes, robot, recording, map_file=map_file))
    (tmp_path / "office.map.journal").write_text("damaged")
    robot.forget()
    node = processes.node(map_file=map_file, localize=True, schedule="lockstep")
    processes.camera(recording, "--rate", 0)
    assert robot.spin_until(lambda: tracked(robot) > FRAMES // 2, 60), node.log.read_text()
    log = node.log.read_text()
    assert "office.map.journal cannot be used" in log and f"starts in the map {map_file}" in log
    assert (tmp_path / "office.map.journal.old").read_text() == "damaged"


@pytest.mark.parametrize("spoiled", ["office.map.frame", "zones.yaml"])
def test_a_map_is_not_replaced_while_a_file_beside_it_is_wrong(processes, robot, recording, tmp_path, spoiled):
    map_file, zones = tmp_path / "office.map", tmp_path / "zones.yaml"
    zones.write_text("zones: [{name: room, polygon: [[-9, -9, 0], [9, -9, 0], [9, 9, 0], [-9, 9, 0]], height: [0, 3]}]")
    stop(play(processes, robot, recording, map_file=map_file))
    saved = map_file.read_bytes()
    (tmp_path / spoiled).write_text('{"T_map_wor')
    robot.forget()
    node = processes.node(map_file=map_file, zones=zones)
    processes.camera(recording, "--now")
    assert robot.spin_until(lambda: spoiled in node.log.read_text(), 30)
    robot.spin_until(lambda: False, 2)
    stop(node)
    assert "fix: " in node.log.read_text() and "Traceback" not in node.log.read_text()
    kept = map_file if spoiled == "zones.yaml" else tmp_path / "office.map.old"
    assert kept.read_bytes() == saved


def test_parameters_are_not_changed_later(processes, robot, recording):
    processes.node()
    wanted = [Parameter(name="grid_cell", value=ParameterValue(type=ParameterType.PARAMETER_DOUBLE, double_value=0.1))]
    answer = robot.call(SetParameters, "set_parameters", parameters=wanted).results[0]
    assert not answer.successful and "at the start" in answer.reason


def test_the_map_before_a_reset_is_kept(processes, robot, recording, tmp_path):
    map_file = tmp_path / "office.map"
    node = play(processes, robot, recording, map_file=map_file)
    answer = robot.call(Trigger, "reset")
    saved = (tmp_path / "office.map.old").read_bytes()
    assert answer.success and answer.message.endswith(f"kept as {map_file}.old")
    robot.forget()
    processes.camera(recording, "--rate", 0, "--count", 20)
    assert robot.spin_until(lambda: robot.count("pose") == 20, 40), node.log.read_text()
    stop(node)
    assert (tmp_path / "office.map.old").read_bytes() == saved
    assert map_file.exists() and map_file.read_bytes() != saved
    assert "saved the map" in node.log.read_text()


def test_images_of_another_size_are_refused_with_both_sizes(processes, robot, recording):
    node = processes.node()
    processes.camera(recording, "--now", "--half")
    assert robot.spin_until(lambda: robot.says("160 x 120 pixels, camera_info said 320 x 240"), 30), node.log.read_text()
    assert not robot.count("pose")


def test_a_camera_that_restarts_and_a_clock_that_is_set_back_lose_nothing(processes, robot, recording):
    node = processes.node()
    processes.camera(recording)
    assert robot.spin_until(lambda: robot.says("no images for"), 40), node.log.read_text()
    robot.forget()
    processes.camera(recording, "--best-effort", "--back", 1000, "--repeat", 4)
    assert robot.spin_until(lambda: robot.count("pose") > 10, 40), f"{robot.values()} {node.log.read_text()}"
    message = robot.got["pose"][-1]
    truth = np.loadtxt(recording / "groundtruth.txt")
    assert nanoseconds(message.header.stamp) / 1e9 < truth[0, 0], "the stamps are those of the images"
    T_map_base = matrix_of_message(message.pose.pose)
    assert np.linalg.norm(T_map_base[:3, 3]) < 1.5


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_a_node_that_starts_again_is_found_in_its_map(processes, robot, recording, tmp_path, number):
    map_file = tmp_path / "office.map"
    node = play(processes, robot, recording, map_file=map_file)
    robot.spin_until(lambda: False, 1.5)
    first = matrix_of_message(robot.got["pose"][0].pose.pose)
    stop(node, number)
    assert map_file.exists() == (number == signal.SIGINT)
    robot.forget()
    node = processes.node(map_file=map_file, localize=True, schedule="lockstep")
    processes.camera(recording, "--rate", 0)
    assert robot.spin_until(lambda: tracked(robot) > FRAMES // 2, 60), node.log.read_text()
    assert "starts in the map" in node.log.read_text()
    found = robot.got["pose"][0]
    truth = np.loadtxt(recording / "groundtruth.txt")
    i = int(np.argmin(np.abs(truth[:, 0] - nanoseconds(found.header.stamp) / 1e9)))
    expected = first @ BASE(truth, 0, i)
    assert np.linalg.norm(matrix_of_message(found.pose.pose)[:3, 3] - expected[:3, 3]) < 0.25


def test_poses_elsewhere_are_not_given_as_those_of_the_loaded_map(processes, robot, recording, tmp_path):
    map_file, mirrored = tmp_path / "office.map", tmp_path / "mirrored"
    stop(play(processes, robot, recording, map_file=map_file))
    shutil.copytree(recording, mirrored)
    for file in [*mirrored.glob("rgb/*.png"), *mirrored.glob("depth/*.png")]:
        cv2.imwrite(str(file), cv2.imread(str(file), cv2.IMREAD_UNCHANGED)[:, ::-1])
    robot.forget()
    node = processes.node(map_file=map_file, schedule="lockstep")
    processes.camera(mirrored, "--rate", 0)
    assert robot.spin_until(lambda: robot.says("not connected with the loaded one"), 60), node.log.read_text()
    assert robot.spin_until(lambda: robot.count("odom") > 10, 20), "the odometry goes on"
    assert not robot.count("pose") and not robot.count("map")
    assert not [t for t in robot.got["tf"] if t.child_frame_id == "odom"], "no frame map yet"


def test_a_map_is_loaded_while_another_is_made(processes, robot, recording, base_to_camera, tmp_path):
    truth = np.loadtxt(recording / "groundtruth.txt")
    T_world_base = [matrix_of_pose(*row[1:]) @ inverse(base_to_camera) for row in truth]

    def far(poses, start):
        """The largest distance of the poses from those of a map that starts at a frame."""
        frames = [int(np.argmin(np.abs(truth[:, 0] - nanoseconds(m.header.stamp) / 1e9))) for m in poses]
        expected = [inverse(T_world_base[start]) @ T_world_base[i] for i in frames]
        return max(np.linalg.norm(matrix_of_message(m.pose.pose)[:3, 3] - T[:3, 3]) for m, T in zip(poses, expected))
    map_file = tmp_path / "office.map"
    stop(play(processes, robot, recording, map_file=map_file))
    robot.forget()
    node = processes.node(schedule="lockstep", map_file=tmp_path / "new.map")
    processes.camera(recording, "--rate", 0, "--first", 30, "--count", 30)
    assert robot.spin_until(lambda: tracked(robot) == 30 and robot.count("pose") == 30, 60), node.log.read_text()
    assert far(robot.got["pose"], 30) < 0.03 < 0.06 < far(robot.got["pose"], 0)
    robot.forget()
    assert robot.call(LoadMap, "load_map", map_url=str(map_file)).result == LoadMap.Response.RESULT_SUCCESS
    processes.camera(recording, "--rate", 0, "--first", 60, "--known")
    assert robot.spin_until(lambda: robot.count("pose") > 5, 60), f"{robot.values()} {node.log.read_text()}"
    assert far(robot.got["pose"], 0) < 0.03, "in the loaded map"
    assert robot.spin_until(lambda: robot.count("map"), 10)
    frames = [json.loads((tmp_path / name).read_text()) for name in ("office.map.frame", "new.map.journal.frame")]
    assert frames[0] == frames[1]


def test_objects_that_changed_since_the_loaded_map_are_shown(processes, robot, tmp_path):
    visits, map_file = [tmp_path / "1", tmp_path / "2"], tmp_path / "office.map"
    for number, visit in enumerate(visits, 1):
        command("simulate", "--people", 0, "--frames", FRAMES, "--width", 320, "--height", 240, "--visit", number, "--out", visit)
    stop(play(processes, robot, visits[0], map_file=map_file))
    robot.forget()
    node = processes.node(map_file=map_file, schedule="lockstep")
    processes.camera(visits[1], "--rate", 0)
    assert robot.spin_until(lambda: robot.count("changed_objects"), 60), node.log.read_text()
    _, *boxes = robot.got["changed_objects"][-1].markers
    appeared, went = ([box for box in boxes if box.ns == name] for name in ("appeared", "went"))
    assert len(went) == 2 and len(went + appeared) == len(boxes), "bin, printer"
    assert len(appeared) in (1, 2), "parcel, and the edge of the cabinet if two views show it"
    assert all(0.03 < side < 0.6 for box in boxes for side in (box.scale.x, box.scale.y, box.scale.z))


def BASE(truth, a, b):
    """The motion of the camera between two frames; that of the base differs by less than the tolerance."""
    return inverse(matrix_of_pose(*truth[a][1:])) @ matrix_of_pose(*truth[b][1:])


def test_services(processes, robot, recording, tmp_path):
    map_file = tmp_path / "office.map"
    node = processes.node(map_file=map_file)
    assert not robot.call(Trigger, "save_map").success
    processes.camera(recording, "--now", "--repeat", 20)
    assert robot.spin_until(lambda: robot.count("pose") > 30, 40), node.log.read_text()
    assert robot.call(Trigger, "save_map").success and map_file.exists()
    assert robot.call(SetBool, "localize", data=True).success
    assert robot.spin_until(lambda: robot.values()[0].get("mode") == "localize", 5)
    assert robot.call(SetBool, "pause", data=True).success
    assert robot.spin_until(lambda: robot.values()[0].get("state") == "paused", 5)
    robot.forget()
    robot.spin_until(lambda: False, 1)
    assert robot.count("pose") <= 1
    assert robot.call(SetBool, "pause", data=False).success
    assert robot.spin_until(lambda: robot.count("pose") > 3, 20)
    assert robot.call(LoadMap, "load_map", map_url="/nowhere.map").result == LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST
    assert robot.call(LoadMap, "load_map", map_url=__file__).result == LoadMap.Response.RESULT_INVALID_MAP_DATA
    robot.forget()
    assert robot.call(LoadMap, "load_map", map_url=f"file://{map_file}").result == LoadMap.Response.RESULT_SUCCESS
    assert robot.spin_until(lambda: robot.count("pose") > 10, 30), node.log.read_text()
    robot.forget()
    assert robot.call(Trigger, "reset").success
    assert robot.spin_until(lambda: robot.count("pose") > 3, 20)
    way = [np.linalg.norm(matrix_of_message(m.pose.pose)[:3, 3]) for m in robot.got["pose"]]
    assert min(way) < 0.02, "the new map starts at the base"


def test_the_odometry_of_the_robot_is_corrected(processes, robot, recording, base_to_camera):
    """Wheels that drift publish odom -> base_link; map -> odom takes the drift away."""
    from stillmap_ros import messages
    from tf2_msgs.msg import TFMessage
    truth = np.loadtxt(recording / "groundtruth.txt")
    T_world_base = [matrix_of_pose(*row[1:]) @ inverse(base_to_camera) for row in truth]
    node = processes.node(publish_odom=False, schedule="lockstep")
    assert robot.spin_until(lambda: robot.tf.get_subscription_count() > 1, 20), node.log.read_text()
    for i, row in enumerate(truth):
        T_odom_base = inverse(T_world_base[0]) @ T_world_base[i]
        T_odom_base[0, 3] += 0.002 * i
        robot.tf.publish(TFMessage(transforms=[messages.transform_of(T_odom_base, round(1e9 * row[0]), "odom", "base_link")]))
    processes.camera(recording, "--rate", 0)
    assert robot.spin_until(lambda: tracked(robot) == FRAMES, 60), node.log.read_text()
    corrections = [matrix_of(t.transform) for t in robot.got["tf"] if t.child_frame_id == "odom"]
    assert not robot.count("odom")
    assert abs(corrections[-1][0, 3] + 0.002 * (FRAMES - 1)) < 0.03
