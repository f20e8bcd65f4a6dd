# SPDX-License-Identifier: Apache-2.0
"""Sources, trajectories, evaluation, threads and type stubs."""
import ast
import os
import pickle
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import stillmap


def test_a_source_is_an_iterator(recording):
    source = stillmap.source(recording, first=2, count=8, stride=2)
    assert len(source) == 4
    assert [frame.index for frame in source] == [0, 1, 2, 3]
    assert source.skipped == []
    assert len(source) == 0
    half = next(stillmap.source(recording, half_size=True))
    assert half.rgb.shape == (120, 160, 3) and half.depth.dtype == np.float32


def test_a_missing_recording_is_an_error_with_a_fix():
    with pytest.raises(stillmap.Error) as caught:
        stillmap.source("/nowhere")
    assert "/nowhere" in str(caught.value)
    assert caught.value.fix
    assert isinstance(caught.value, RuntimeError)


def test_the_module_is_run_as_the_command():
    command = os.environ.get("STILLMAP_COMMAND")
    if not command:
        pytest.skip("skipped: STILLMAP_COMMAND does not name the command stillmap")
    environment = os.environ | {"PATH": f"{Path(command).parent}:{os.environ['PATH']}"}
    run = subprocess.run([sys.executable, "-m", "stillmap", "--version"], env=environment, check=True, capture_output=True,
                         text=True)
    assert run.stdout.startswith(f"Stillmap {stillmap.__version__} ")
    run = subprocess.run([sys.executable, "-m", "stillmap", "nonsense"], env=environment, check=False, capture_output=True)
    assert run.returncode == 2


def test_frames_outlive_their_source(recording):
    rgb = next(stillmap.source(recording)).rgb
    assert rgb.max() > 0


def test_errors_of_a_trajectory_are_those_of_the_command(recording, frames, command, tmp_path):
    slam = stillmap.Slam(stillmap.source(recording).camera, dense={"enabled": False}, movers={"enabled": False})
    for frame in frames:
        slam.push(frame)
    trajectory = slam.finish().trajectory
    stillmap.write_trajectory(tmp_path / "estimate.txt", trajectory)
    truth = recording / "groundtruth.txt"
    text = command("eval", truth, tmp_path / "estimate.txt").stdout
    ate = stillmap.ate(truth, tmp_path / "estimate.txt")
    assert f"{ate.translation.rmse:.6f}" in text
    assert f"{ate.translation.max:.6f}" in text
    assert stillmap.ate(truth, trajectory).translation.rmse == pytest.approx(ate.translation.rmse, abs=1e-8)
    assert stillmap.rpe(truth, trajectory, delta="frame").rotation.count == len(frames) - 2
    assert stillmap.ate(truth, truth).translation.max < 1e-9


def test_moved_poses_have_no_absolute_error():
    turns = np.linspace(0, 1, 20)
    rows = np.zeros((20, 8))
    rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 7] = np.arange(20), np.cos(turns), np.sin(turns), 1
    moved = rows.copy()
    moved[:, 1:4] += [1, 2, 3]
    result = stillmap.ate(rows, moved)
    assert result.translation.rmse < 1e-12
    np.testing.assert_allclose(result.T_truth_estimate[:3, 3], [-1, -2, -3], atol=1e-9)
    scaled = rows.copy()
    scaled[:, 1:4] *= 2
    assert stillmap.ate(rows, scaled, with_scale=True).scale == pytest.approx(0.5)


def test_unusable_trajectories_are_errors():
    with pytest.raises(stillmap.Error, match=r"estimate has the shape \(3, 7\)"):
        stillmap.ate(np.zeros((3, 8)) + 1, np.zeros((3, 7)))
    with pytest.raises(stillmap.Error, match="truth has a pose in row 0"):
        stillmap.ate(np.full((3, 8), np.nan), np.ones((3, 8)))
    with pytest.raises(stillmap.Error, match="second or frame"):
        stillmap.rpe(np.ones((3, 8)), np.ones((3, 8)), delta="day")


def test_a_trajectory_is_an_array_with_parts(tmp_path):
    file = tmp_path / "trajectory.txt"
    file.write_text("1 1 2 3 0 0 0 1\n2 4 5 6 0 0 0.70710678 0.70710678\n")
    trajectory = stillmap.read_trajectory(file)
    assert isinstance(trajectory, stillmap.Trajectory) and trajectory.shape == (2, 8)
    np.testing.assert_array_equal(trajectory.stamps, [1, 2])
    np.testing.assert_array_equal(trajectory.positions[1], [4, 5, 6])
    turned = trajectory.matrices()[1] @ [1, 0, 0, 1]
    np.testing.assert_allclose(turned, [4, 6, 6, 1], atol=1e-7)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(np.asarray(trajectory))), trajectory)


def test_a_trajectory_becomes_one_of_evo(tmp_path):
    pytest.importorskip("evo", reason="skipped: evo is missing")
    file = tmp_path / "trajectory.txt"
    file.write_text("1 1 2 3 0.1 0.2 0.3 0.9273618\n2 4 5 6 0 0 0 1\n")
    trajectory = stillmap.read_trajectory(file)
    path = trajectory.to_evo()
    np.testing.assert_allclose(np.array(path.poses_se3), trajectory.matrices(), atol=1e-9)


def test_python_threads_run_while_a_frame_is_tracked(frames, camera):
    """A call that kept the GIL would let no other thread run during it."""
    slam = stillmap.Slam(camera)
    ticks, stop, inside = [], threading.Event(), threading.Event()

    def tick():
        while not stop.is_set():
            if inside.is_set():
                ticks.append(1)
            time.sleep(1e-4)

    thread = threading.Thread(target=tick)
    thread.start()
    ticks_within = 0
    for frame in frames:
        inside.set()
        before = len(ticks)
        slam.push(frame)
        ticks_within += len(ticks) - before
        inside.clear()
    stop.set()
    thread.join()
    assert ticks_within > len(frames)


def test_any_thread_may_push_and_take_snapshots(frames, camera):
    slam = stillmap.Slam(camera)
    lengths, failures = [], []

    def watch():
        try:
            while not lengths or lengths[-1] < len(frames):
                lengths.append(len(slam.snapshot().trajectory))
        except Exception as e:
            failures.append(e)

    watchers = [threading.Thread(target=watch) for _ in range(2)]
    for watcher in watchers:
        watcher.start()

    def push(some):
        for frame in some:
            slam.push(frame)

    for part in (frames[:10], frames[10:]):
        pusher = threading.Thread(target=push, args=(part,))
        pusher.start()
        pusher.join()
    for watcher in watchers:
        watcher.join(60)
    assert not failures
    assert max(lengths) == len(frames)


def test_simultaneous_pushes_wait_for_each_other(frames, camera):
    slam = stillmap.Slam(camera, dense={"enabled": False})
    refused = []

    def push(some):
        for frame in some:
            try:
                slam.push(frame.rgb, frame.depth, frame.stamp)
            except stillmap.Error as e:
                refused.append(e.problem)  # a frame of the other thread came first

    pushers = [threading.Thread(target=push, args=(frames[i::2],)) for i in range(2)]
    for pusher in pushers:
        pusher.start()
    for pusher in pushers:
        pusher.join()
    assert slam.finish().statistics["frames"] + len(refused) == len(frames)


def declared_in(stub):
    """Classes with the names that they declare, and functions, of a stub file."""
    classes, functions = {}, set()
    for node in ast.parse(Path(stub).read_text()).body:
        if isinstance(node, ast.ClassDef):
            classes[node.name] = {n.name for n in node.body if isinstance(n, ast.FunctionDef)} | {
                n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}
        elif isinstance(node, ast.FunctionDef):
            functions.add(node.name)
    return classes, functions


def test_the_stubs_declare_what_the_module_has():
    folder = Path(stillmap.__file__).parent
    assert (folder / "py.typed").exists()
    classes, functions = declared_in(folder / "__init__.pyi")
    assert set(classes) | functions | {"Trajectory", "__version__"} == set(stillmap.__all__)
    for name, declared in classes.items():
        public = {n for n in vars(getattr(stillmap, name)) if not n.startswith("_")}
        if name != "Error":
            assert {n for n in declared if not n.startswith("_")} == public, name


def test_the_loop_of_the_documentation_has_types(tmp_path, monkeypatch):
    api = pytest.importorskip("mypy.api")
    (tmp_path / "stubs").mkdir()
    (tmp_path / "stubs" / "stillmap").symlink_to(Path(stillmap.__file__).parent)
    monkeypatch.setenv("MYPYPATH", str(tmp_path / "stubs"))
    program = tmp_path / "loop.py"
    program.write_text("import stillmap\n"
                       "def show(slam: stillmap.Slam) -> None:\n"
                       "    for mover in slam.movers:\n"
                       "        print(mover.id, mover.class_name, mover.centroid, mover.velocity)\n")
    text, _, code = api.run(["--strict", "--cache-dir", str(tmp_path / "cache"), str(program)])
    assert code == 0, text


def test_everything_public_is_documented():
    for name in stillmap.__all__:
        if name != "__version__":
            assert getattr(stillmap, name).__doc__, name
