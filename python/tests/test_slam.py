# SPDX-License-Identifier: Apache-2.0
"""The class Slam against the command, and its results."""
import re

import numpy as np
import pytest

import stillmap


def read_masks(recording):
    """The masks of the recording by the timestamps in their names; needs an image reader."""
    image = pytest.importorskip("PIL.Image", reason="skipped: Pillow is missing")
    return {float(file.stem): np.array(image.open(file)) for file in (recording / "mask").glob("*.png")}


def same_files(first, second, names):
    for name in names:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name


def test_frames_of_a_source_give_the_bytes_of_the_command(recording, command, tmp_path):
    command("run", recording, "--out", tmp_path / "command")
    source = stillmap.source(recording)
    slam = stillmap.Slam(source.camera)
    for frame in source:
        slam.push(frame)
    slam.finish().write(tmp_path / "python")
    same_files(tmp_path / "command", tmp_path / "python",
               ["trajectory.txt", "trajectory_covariance.txt", "keyframes.txt", "cloud.ply", "movers.csv"])


@pytest.mark.parametrize("layout", ["copied RGB", "view of BGR", "strided"])
def test_arrays_give_the_bytes_of_the_command(recording, frames, camera, command, tmp_path, layout):
    command("run", recording, "--out", tmp_path / "command", "--set", "dense.enabled=false", "--preset", "orb-rgbd")
    slam = stillmap.Slam(camera, {"dense.enabled": False}, preset="orb-rgbd")
    for frame in frames:
        rgb, depth = frame.rgb, frame.depth
        if layout == "copied RGB":
            rgb, depth = np.ascontiguousarray(rgb), depth.copy()
        elif layout == "strided":
            rgb = np.dstack([rgb, rgb])[:, :, :3]  # six bytes from pixel to pixel
            depth = np.asfortranarray(depth)
        slam.push(rgb, depth, frame.stamp)
    slam.finish().write(tmp_path / "python")
    same_files(tmp_path / "command", tmp_path / "python", ["trajectory.txt", "keyframes.txt"])


def test_depth_in_raw_units_gives_the_same_poses_as_in_meters(frames, camera):
    trajectories = []
    for raw in (False, True):
        slam = stillmap.Slam(camera, dense={"enabled": False}, movers={"enabled": False})
        for frame in frames[:6]:
            depth = np.round(frame.depth * camera.depth_factor).astype(np.uint16) if raw else frame.depth
            slam.push(frame.rgb, depth, frame.stamp)
        trajectories.append(slam.finish().trajectory)
    np.testing.assert_array_equal(*trajectories)


def test_pushed_masks_give_the_bytes_of_a_folder_of_masks(recording, frames, camera, command, tmp_path):
    masks = read_masks(recording)
    command("run", recording, "--out", tmp_path / "command", "--masks", recording / "mask")
    slam = stillmap.Slam(camera, {"network.every": 3, "network.mask_delay": 2}, masks=True)
    for frame in frames:
        slam.push(frame, masks[min(masks, key=lambda stamp: abs(stamp - frame.stamp))])
    slam.finish().write(tmp_path / "python")
    same_files(tmp_path / "command", tmp_path / "python", ["trajectory.txt", "cloud.ply"])


def test_the_newest_frame_has_motion_labels_and_objects(recording, frames, camera):
    masks = read_masks(recording)
    slam = stillmap.Slam(camera, {"network.every": 1, "network.mask_delay": 0, "dense.enabled": False}, masks=True)
    assert slam.newest is None
    largest, on_people, moving = 0, [], []
    for frame in frames:
        shown = masks[min(masks, key=lambda stamp: abs(stamp - frame.stamp))]
        slam.push(frame, shown)
        seen = slam.newest
        u, v = (seen.keypoints[:, :2].T + 0.5).astype(int)
        on_people.extend(shown[v, u] != 0)
        moving.extend(seen.moving)
        if np.count_nonzero(shown) > largest:
            largest, mask, newest, pushed = np.count_nonzero(shown), shown, seen, frame
    slam.finish()
    assert newest.update.stamp == pushed.stamp and newest.mask_age == 0
    np.testing.assert_array_equal(newest.rgb, pushed.rgb)
    np.testing.assert_array_equal(newest.depth, pushed.depth)
    count = len(newest.keypoints)
    assert newest.keypoints.shape == (count, 3) and newest.keypoints.dtype == np.float32
    for values in (newest.static_probabilities, newest.moving, newest.matched):
        assert values.shape == (count,) and not values.flags.writeable
    on_people, moving = np.array(on_people), np.array(moving)
    assert on_people.sum() > 50
    assert moving[on_people].mean() > 0.9 and moving[~on_people].mean() < 0.1
    assert newest.static_probabilities[newest.moving].max() < 0.5
    assert (newest.moving_mask[mask != 0] == 255).mean() > 0.9
    person = max(newest.objects, key=lambda o: o.box[2] * o.box[3])
    left, top, width, height = person.box
    assert person.class_name == "person" and person.mask.shape == (height, width)
    shown = mask[top:top + height, left:left + width] != 0
    assert ((person.mask != 0) == shown).mean() > 0.95


def test_a_pose_is_a_matrix_and_agrees_with_the_truth(recording, frames, slam):
    poses = [slam.push(frame).T_world_camera for frame in frames]
    assert all(pose.shape == (4, 4) and pose.dtype == np.float64 for pose in poses)
    np.testing.assert_allclose(poses[0], np.eye(4), atol=1e-9)
    np.testing.assert_allclose(poses[-1][:3, :3] @ poses[-1][:3, :3].T, np.eye(3), atol=1e-9)
    results = slam.finish()
    ate = stillmap.ate(recording / "groundtruth.txt", results.trajectory)
    assert ate.translation.rmse < 0.02
    assert ate.translation.count == len(frames)
    assert ate.scale == 1


def test_a_snapshot_has_the_state_of_the_newest_frame(frames, camera):
    slam = stillmap.Slam(camera)
    for frame in frames:
        update = slam.push(frame)
    snapshot = slam.snapshot()
    np.testing.assert_allclose(snapshot.newest.T_world_camera, update.T_world_camera, atol=1e-12)
    assert snapshot.newest.state == update.state == "tracked"
    assert snapshot.newest.index == len(frames) - 1
    assert snapshot.newest.covariance.shape == (6, 6)
    assert snapshot.trajectory.shape == (len(frames), 8)
    assert snapshot.landmarks.shape == (len(snapshot.static_probabilities), 3)
    assert len(slam.trajectory) == len(frames)
    assert all(mover.box.shape == (2, 3) for mover in slam.movers)


def test_clouds_are_views_that_outlive_the_system(frames, camera, tmp_path):
    slam = stillmap.Slam(camera)
    for frame in frames:
        slam.push(frame)
    cloud = slam.finish().cloud
    points, colors = cloud.points, cloud.colors
    cloud.write(tmp_path / "cloud.ply")
    del slam, cloud
    assert points.dtype == np.float32 and points.shape[1] == 3 and len(points) > 1000
    assert colors.dtype == np.uint8 and colors.shape == points.shape
    assert not points.flags.writeable
    read = stillmap.read_ply(tmp_path / "cloud.ply")
    np.testing.assert_array_equal(read.points, points)
    np.testing.assert_array_equal(read.colors, colors)


def test_without_frames_all_arrays_are_empty(slam):
    assert slam.trajectory.shape == (0, 8)
    assert slam.cloud.points.shape == (0, 3)
    assert slam.snapshot().newest.T_world_camera is None
    assert slam.finish().covariances.shape == (0, 6, 6)


def test_a_journal_is_a_start_for_another_run(frames, camera, tmp_path):
    slam = stillmap.Slam(camera)
    slam.keep_journal(tmp_path / "run.journal")
    for frame in frames:
        slam.push(frame)
    slam.finish()
    again = stillmap.Slam(camera, load_map=tmp_path / "run.journal", extend_map=False)
    assert [again.push(frame) for frame in frames][-1].state == "tracked"
    with pytest.raises(stillmap.Error, match="journal of another run"):
        again.keep_journal(tmp_path / "run.journal")


def test_a_saved_map_is_a_start_for_another_run(frames, camera, tmp_path):
    slam = stillmap.Slam(camera)
    for frame in frames:
        slam.push(frame)
    slam.save_map(tmp_path / "early.map")
    slam.finish()
    slam.save_map(tmp_path / "office.map")
    for name in ("early.map", "office.map"):
        again = stillmap.Slam(camera, load_map=tmp_path / name, extend_map=False)
        updates = [again.push(frame) for frame in frames]
        assert updates[0].state == "lost" and "not recognized yet" in updates[0].reason
        assert updates[-1].state == "tracked" and updates[-1].in_saved_map and not updates[0].in_saved_map
    with pytest.raises(stillmap.Error, match="nowhere.map"):
        stillmap.Slam(camera, load_map="/nowhere.map")


def test_a_map_is_loaded_while_it_runs(frames, camera, tmp_path):
    slam = stillmap.Slam(camera, movers={"enabled": False})
    for frame in frames:
        slam.push(frame)
    slam.save_map(tmp_path / "office.map")
    slam.finish()
    again = stillmap.Slam(camera, movers={"enabled": False})
    half = len(frames) // 2
    for frame in frames[half // 2:half]:
        again.push(frame)
    assert again.load_map(tmp_path / "office.map") == ""
    for frame in frames[half:]:
        again.push(frame)
    results = again.finish()
    expected = dict(zip(slam.trajectory[:, 0], slam.trajectory[:, 1:4]))
    for stamp, *position in results.trajectory[:, :4]:
        np.testing.assert_allclose(position, expected[stamp], atol=0.03)
    with pytest.raises(stillmap.Error, match="nowhere.map"):
        stillmap.Slam(camera).load_map("/nowhere.map")


def test_what_changed_since_the_loaded_map_was_made(command, tmp_path):
    saved = tmp_path / "office.map"

    def pushed(visit, **start):
        command("simulate", "--people", 0, "--frames", 90, "--width", 320, "--height", 240, "--visit", visit, "--out",
                tmp_path / f"visit{visit}")
        source = stillmap.source(tmp_path / f"visit{visit}")
        slam = stillmap.Slam(source.camera, movers={"enabled": False}, **start)
        for frame in source:
            slam.push(frame)
        return slam
    first = pushed(1)
    assert first.changes() == [], "there is one visit"
    first.save_map(saved)
    second = pushed(2, load_map=saved)
    changes = second.changes()
    went, appeared = [c.before for c in changes if c.after is None], [c.after for c in changes if c.before is None]
    assert len(went) == 2 and len(went + appeared) == len(changes), "bin, printer"
    assert len(appeared) in (1, 2), "parcel, and the edge of the cabinet if two views show it"
    for box in went + appeared:
        assert box.shape == (2, 3) and (0 < box[1] - box[0]).all() and (box[1] - box[0] < 0.6).all()
    assert {c.class_name for c in changes} == {"unknown"}
    second.save_map(tmp_path / "later.map")
    compared = stillmap.compare_maps(saved, tmp_path / "later.map")
    gone = [c.before.mean(0) for c in compared if c.after is None]
    np.testing.assert_allclose(gone, [box.mean(0) for box in went], atol=0.05)
    second.finish()
    with pytest.raises(stillmap.Error, match="has ended"):
        second.changes()


def test_warnings_of_rules(frames, camera, tmp_path):
    rules = tmp_path / "rules.yaml"
    rules.write_text("zones: [{name: all, polygon: [[-9, 1, -9], [9, 1, -9], [9, 1, 9], [-9, 1, 9]], height: [-9, 9]}]")
    slam = stillmap.Slam(camera, masks=True)
    assert slam.warnings == []
    slam.watch(rules)
    mask = np.zeros((camera.height, camera.width), np.uint8)
    mask[camera.height // 4:, camera.width // 3:camera.width // 2] = 255
    for frame in frames:
        slam.push(frame, mask)
    inside = [w for w in slam.warnings if w.kind == "zone"]
    assert {w.mover for w in inside} == {m.id for m in slam.movers} != set()
    assert inside[0].rule == "all" and inside[0].class_name == "person" and inside[0].position.shape == (3,)
    assert str(inside[0]) == f"person {inside[0].mover} is in zone 'all'"
    with pytest.raises(stillmap.Error, match="polygon"):
        rules.write_text("zones: [{name: none, polygon: []}]")
        slam.watch(rules)


def test_a_stereo_pair_is_pushed():
    texture = np.random.default_rng(1).integers(0, 256, (240, 332, 3), np.uint8)
    left, right = texture[:, :320], texture[:, 12:]
    camera = stillmap.Camera(320, 240, 350, 350, 160, 120, depth_factor=1000, sensor="stereo", baseline=0.12)
    slam = stillmap.Slam(camera)
    assert slam.push_stereo(left, right, 1.0).index == 0
    depth = slam.newest.depth[120, 200]
    assert abs(depth - 3.5) < 0.04
    with pytest.raises(stillmap.Error, match="exchanged"):
        stillmap.Slam(camera).push_stereo(right, left, 1.0)


def test_the_grid_of_the_live_cloud(frames, camera):
    slam = stillmap.Slam(camera)
    for frame in frames[:10]:
        slam.push(frame)
    cloud = slam.snapshot().cloud
    T_map_world = np.array([[0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 1.0], [0, 0, 0, 1]])
    grid = stillmap.navigation_grid(cloud, T_map_world, way=np.zeros((1, 3)), cell=0.1)
    points = cloud.points @ T_map_world[:3, :3].T + T_map_world[:3, 3]
    seen = points[(points[:, 2] > 0.11) & (points[:, 2] < 1.79)]
    u, v = np.floor((seen[:, :2] - grid.origin) / grid.cell).astype(int).T
    assert len(seen) > 100 and (grid.cells[v, u] == 100).all() and (grid.distances[v, u] == 0).all()
    assert grid.distances.dtype == np.float32 and grid.distances.shape == grid.cells.shape
    assert grid.distance_at(0, 0) > 0 and grid.distance_at(100, 0) is None
    by_numbers = stillmap.navigation_grid(cloud, [0, 0, 1, -0.5, 0.5, -0.5, 0.5], way=np.zeros((1, 3)), cell=0.1)
    assert (by_numbers.cells == grid.cells).all()
    for wrong in (np.zeros((4, 4)), np.zeros(7)):
        with pytest.raises(stillmap.Error, match="T_map_world"):
            stillmap.navigation_grid(cloud, wrong)


def test_the_distance_field_of_the_live_cloud(frames, camera):
    slam = stillmap.Slam(camera)
    for frame in frames[:10]:
        slam.push(frame)
    cloud = slam.snapshot().cloud
    field = stillmap.distance_field(cloud, cell=0.1, margin=1)
    cells = np.floor((cloud.points - field.origin) / field.cell).astype(int)
    assert (field.distances[tuple(cells.T)] == 0).all() and field.distances.dtype == np.float32
    far = np.argwhere(field.distances > 0.5)[0]
    center = field.origin + field.cell * (far + 0.5)
    nearest = np.linalg.norm(field.origin + field.cell * (np.unique(cells, axis=0) + 0.5) - center, axis=1).min()
    assert abs(field.distances[tuple(far)] - nearest) < 1e-4
    inner = field.origin + field.cell * np.array(field.distances.shape) / 2
    assert field.distance_at(*inner) >= 0 and field.gradient_at(*inner).shape == (3,)
    assert field.distance_at(100, 0, 0) is None and field.gradient_at(100, 0, 0) is None
    with pytest.raises(stillmap.Error, match="side of a cell"):
        stillmap.distance_field(cloud, cell=0)


def test_voxels_of_the_live_cloud(frames, camera):
    slam = stillmap.Slam(camera, movers={"enabled": False})
    for frame in frames:
        slam.push(frame)
        if frame is frames[-4]:
            before = slam.snapshot()
    after = slam.snapshot()
    assert len(after.cloud_voxels) == len(after.cloud) == len(np.unique(after.cloud_voxels)) > 1000
    assert after.cloud_voxels.dtype == np.uint64
    _, i, k = np.intersect1d(before.cloud_voxels, after.cloud_voxels, return_indices=True)
    assert len(i) > 1000
    assert np.abs(before.cloud.points[i] - after.cloud.points[k]).max() < 0.0201, "in the same voxel of 2 cm"
    slam.finish()
    assert len(slam.snapshot().cloud_voxels) == 0


def test_an_unknown_place_is_explained(frames, camera, tmp_path):
    slam = stillmap.Slam(camera, dense={"enabled": False}, movers={"enabled": False})
    for frame in frames[:4]:
        slam.push(frame)
    slam.save_map(tmp_path / "office.map")
    again = stillmap.Slam(camera, load_map=tmp_path / "office.map", extend_map=False)
    mirrored = [again.push(frame.rgb[:, ::-1], frame.depth[:, ::-1], frame.stamp) for frame in frames]
    assert all(update.state == "lost" for update in mirrored)
    assert re.search("no similar keyframe|needed|no pose fits|expected landmarks", mirrored[-1].reason)


def test_saved_maps_are_merged(frames, camera, tmp_path):
    files = [tmp_path / "a.map", tmp_path / "b.map"]
    for file, part in zip(files, (frames[:18], frames[6:])):
        slam = stillmap.Slam(camera, dense={"enabled": False}, movers={"enabled": False})
        for frame in part:
            slam.push(frame)
        slam.save_map(file)
    pair, = stillmap.merge_maps(files, tmp_path / "all.map")
    assert (pair.a, pair.b) == tuple(files)
    assert pair.connected and pair.places > 1 and pair.reason == ""
    again = stillmap.Slam(camera, load_map=tmp_path / "all.map", extend_map=False)
    assert [again.push(frame) for frame in frames[3:6]][-1].state == "tracked"
    with pytest.raises(stillmap.Error, match="needs at least two maps"):
        stillmap.merge_maps(files[:1], tmp_path / "one.map")
    before = files[0].read_bytes()
    with pytest.raises(stillmap.Error, match="is one of the maps to read"):
        stillmap.merge_maps(files, files[0])
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(stillmap.Error, match="is no map"):
        stillmap.merge_maps(files, tmp_path / "notes.txt")
    assert (files[0].read_bytes(), (tmp_path / "notes.txt").read_text()) == (before, "mine")


def test_the_mode_changes_while_it_runs(frames, camera):
    slam = stillmap.Slam(camera, movers={"enabled": False})
    keyframes = []
    for mode, part in (("map", frames[:8]), ("localize", frames[8:16]), ("map", frames[16:])):
        slam.set_mode(mode)
        updates = [slam.push(frame) for frame in part]
        assert all(update.state == "tracked" for update in updates)
        keyframes.append(slam.snapshot().keyframes[:, 0])
    np.testing.assert_array_equal(keyframes[0], keyframes[1])
    with pytest.raises(stillmap.Error, match='give "map" or "localize"'):
        slam.set_mode("mapping")


def test_the_motions_between_frames_are_the_odometry(frames, slam):
    updates = [slam.push(frame) for frame in frames]
    assert updates[0].T_previous_camera is None
    pose = updates[1].T_world_camera
    for update in updates[2:]:
        pose = pose @ update.T_previous_camera
    np.testing.assert_allclose(pose, updates[-1].T_world_camera, atol=0.02)


def test_a_gyroscope_is_pushed_with_the_frames(frames, camera):
    def positions(imu):
        slam = stillmap.Slam(camera_with(imu))
        for frame in frames[:10]:
            if imu is not None:
                for i in range(7):
                    slam.push_imu(frame.stamp - 0.03 + 0.005 * i, [1e-4 * i, 0.0, 0.0], np.array([0, -9.81, 0]))
            slam.push(frame.rgb, frame.depth, frame.stamp)
        return np.asarray(slam.finish().trajectory)

    def camera_with(imu):
        copy = stillmap.Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
                               depth_factor=camera.depth_factor)
        copy.imu = imu
        return copy

    with_imu = positions(stillmap.Imu("d435i", T_camera_imu=np.eye(4)))
    assert not np.array_equal(with_imu, positions(None))  # it says that the camera does not turn
    with pytest.raises(stillmap.Error, match="has no IMU"):
        stillmap.Slam(camera_with(None)).push_imu(1, [0, 0, 0], [0, 0, 0])
    with pytest.raises(stillmap.Error, match="is no rigid motion"):
        stillmap.Imu(T_camera_imu=2 * np.eye(4))
    with pytest.raises(stillmap.Error, match="d435i"):
        stillmap.Imu("d435")


def test_the_odometry_of_wheels_gives_the_pose_in_the_dark(frames, camera):
    on_wheels = stillmap.Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
                                depth_factor=camera.depth_factor)
    assert on_wheels.T_camera_base is None
    on_wheels.T_camera_base = np.eye(4)
    np.testing.assert_array_equal(on_wheels.T_camera_base, np.eye(4))
    slam = stillmap.Slam(on_wheels)
    states = []
    for frame in frames[:10]:
        slam.push_odometry(frame.stamp, np.eye(4))
        dark = len(states) >= 8
        states.append(slam.push(np.zeros_like(frame.rgb) if dark else frame.rgb, frame.depth, frame.stamp).state)
    assert states == ["tracked"] * 8 + ["predicted"] * 2
    with pytest.raises(stillmap.Error, match="is on no wheels"):
        stillmap.Slam(camera).push_odometry(1, np.eye(4))
    for wrong in (2 * np.eye(4), np.diag([1, 1, -1, 1]), np.diag([1, 1, 1, 2])):
        with pytest.raises(stillmap.Error, match="no rigid motion"):
            on_wheels.T_camera_base = wrong


def test_nothing_is_pushed_after_the_end(frames, slam):
    slam.finish()
    with pytest.raises(stillmap.Error) as caught:
        slam.push(frames[0])
    assert caught.value.problem == "the run has ended with finish()"
    assert caught.value.where == "Slam::push"
    assert str(caught.value) == "Slam::push: the run has ended with finish()\n  fix: make another Slam"


def test_a_frame_of_another_camera_is_refused(frames, camera):
    other = stillmap.Camera(camera.width, camera.height, camera.fx + 20, camera.fy, camera.cx, camera.cy,
                            depth_factor=camera.depth_factor)
    with pytest.raises(stillmap.Error, match=r"another camera.*\n.*Slam\(source.camera\)"):
        stillmap.Slam(other).push(frames[0])


def test_a_wrong_depth_factor_is_a_finding(recording):
    camera = stillmap.source(recording).camera
    wrong = stillmap.Camera(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
                            depth_factor=camera.depth_factor / 10)
    options = {"dense": {"enabled": False}, "movers": {"enabled": False}}
    for used, codes in ((camera, []), (wrong, ["no-depth", "low-coverage"])):
        slam = stillmap.Slam(used, **options)
        for frame in stillmap.source(recording, camera=used):
            slam.push(frame)
            early = [f.code for f in slam.findings]
        assert early == codes[:1]
        findings = slam.finish().findings
        assert [f.code for f in findings] == codes
        assert all(f.severity == "untrusted" and f.fix for f in findings)
