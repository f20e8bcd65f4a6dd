#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kills runs at random moments: nothing older is destroyed, every file is whole or absent, and `stillmap recover`
writes the results of all but the last second.

  apps/recover_test.py PROGRAM [--kills N] [--seed S] [--lost SECONDS]    PROGRAM: the built command
"""
import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = ""
KILLS = 4
SEED = 1
FRAMES = 210
LOST = 3  # most seconds that may be lost: on an idle machine it is one, here other tests run beside


def stillmap(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)


def poses(file):
    """The lines of a trajectory, as lists of numbers; fails for a line that is not whole."""
    lines = [line for line in file.read_text().splitlines() if not line.startswith("#")]
    numbers = [[float(number) for number in line.split()] for line in lines]
    assert all(len(line) == 8 for line in numbers), file
    return numbers


def require_whole(folder):
    """Every file with a final name is whole."""
    for file in folder.iterdir():
        if file.suffix == ".json":
            json.loads(file.read_text())
        if file.suffix == ".png":
            assert file.read_bytes().endswith(b"IEND\xaeB`\x82"), file
        if file.name in ("trajectory.txt", "keyframes.txt"):
            poses(file)
        if file.name == "run.map":
            shown = stillmap("map", "info", file)
            assert shown.returncode == 0, shown.stderr


class KilledRuns(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.sequence = cls.folder / "office"
        made = stillmap("simulate", "--people", 1, "--frames", FRAMES, "--width", 320, "--height", 240, "--out",
                        cls.sequence)
        assert made.returncode == 0, made.stderr
        cls.saved = cls.folder / "saved.map"
        begin = time.monotonic()
        whole = cls.run_to_end("whole", "--save-map", cls.saved)
        cls.seconds = time.monotonic() - begin
        assert whole.returncode == 0, whole.stderr
        cls.random = random.Random(SEED)

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def arguments(cls, out, *more):
        return ["run", cls.sequence, "--out", cls.folder / out, "--set", "network.masks=" + str(cls.sequence / "mask"),
                *more]

    @classmethod
    def run_to_end(cls, out, *more):
        return stillmap(*cls.arguments(out, *more))

    def run_and_kill(self, out, seconds, signal_number=signal.SIGKILL, *more):
        """Returns the time between the last pose of the run and its end, or None if it ended by itself."""
        # In realtime the camera's time is that of the clock, so that the last second is one of the recording.
        process = subprocess.Popen([PROGRAM, *map(str, self.arguments(out, "--schedule", "realtime", *more))],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                                   # The tests may have been started with nohup.
                                   preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL))
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.send_signal(signal_number)
        return process.wait()

    def test_any_moment(self):
        killed = recovered = 0
        for number in range(KILLS):
            out = self.folder / f"killed_{number}"
            before = self.saved.read_bytes()
            code = self.run_and_kill(out.name, self.random.uniform(0.3, 1.1 * FRAMES / 30 + 1), signal.SIGKILL,
                                     "--load-map", self.saved, "--save-map", self.saved)
            require_whole(out) if out.exists() else None
            shown = stillmap("map", "info", self.saved)
            self.assertEqual(shown.returncode, 0, shown.stderr)
            killed += code == -signal.SIGKILL
            if code == -signal.SIGKILL and (out / "run.journal").exists():
                recovered += self.check_recovery(out)
            elif code != -signal.SIGKILL:
                self.assertIn(code, (0, 3))
                self.assertFalse((out / "run.journal").exists())
                self.saved.write_bytes(before)
        print(f"{KILLS} runs: {killed} killed, {recovered} of them recovered", file=sys.stderr)
        self.assertGreater(recovered, KILLS // 4)

    def check_recovery(self, out):
        """Returns whether the run had come far enough to be recovered."""
        live = [line.split() for line in (out / "trajectory_live.txt").read_text().splitlines()[1:]
                if not line.startswith("#") and len(line.split()) == 8]
        if not live:
            return False
        last = float(live[-1][0])
        first = float(live[0][0])
        written = stillmap("recover", out)
        if last - first < LOST and written.returncode == 1:
            self.assertIn("first second", written.stderr)
            return False
        self.assertIn(written.returncode, (0, 3), written.stderr)
        require_whole(out)
        self.assertFalse((out / "run.journal").exists())
        recovered = poses(out / "trajectory.txt")
        self.assertGreater(recovered[-1][0] if recovered else first, last - LOST)
        if len(recovered) > 30:
            errors = out / "errors.json"
            evaluated = stillmap("eval", self.sequence / "groundtruth.txt", out / "trajectory.txt", "--json", errors)
            self.assertEqual(evaluated.returncode, 0, evaluated.stderr)
            self.assertLess(json.loads(errors.read_text())["ate"]["translation_m"]["rmse"], 0.02)
        return True

    def test_the_results_of_a_killed_run_are_not_overwritten(self):
        self.run_and_kill("kept", 3)
        journal = self.folder / "kept" / "run.journal"
        before = journal.read_bytes()
        again = self.run_to_end("kept")
        self.assertEqual(again.returncode, 1)
        self.assertIn("did not end", again.stderr)
        self.assertIn("recover", again.stderr)
        self.assertIn("recover", stillmap("view", self.folder / "kept", "--port", 0).stderr)
        self.assertEqual(journal.read_bytes(), before)
        self.assertIn(self.run_to_end("kept", "--force").returncode, (0, 3))
        self.assertFalse(journal.exists())
        self.assertEqual(stillmap("recover", self.folder / "kept").returncode, 1)

    def test_recovery_does_not_replace_more_poses_by_fewer(self):
        self.assertIn(self.run_to_end("twice").returncode, (0, 3))
        out = self.folder / "twice"
        self.run_and_kill("twice", 2)
        before = (out / "trajectory.txt").read_bytes()
        refused = stillmap("recover", out)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("the killed run has only", refused.stderr)
        self.assertEqual((out / "trajectory.txt").read_bytes(), before)
        live = (out / "trajectory_live.txt").read_bytes()
        elsewhere = stillmap("recover", out, "--out", self.folder / "elsewhere")
        self.assertIn(elsewhere.returncode, (0, 3), elsewhere.stderr)
        self.assertIn(stillmap("recover", out, "--force").returncode, (0, 3))
        self.assertEqual((out / "trajectory_live.txt").read_bytes(), live)

    def test_the_next_run_begins_in_the_map_of_a_killed_one(self):
        self.run_and_kill("first", 4)
        info = stillmap("map", "info", self.folder / "first")
        self.assertEqual(info.returncode, 0, info.stderr)
        second = self.run_to_end("second", "--load-map", self.folder / "first")
        self.assertIn(second.returncode, (0, 3), second.stderr)
        summary = json.loads((self.folder / "second" / "summary.json").read_text())
        self.assertGreater(summary["frames"]["tracked"], FRAMES * 0.8)

    def test_a_closed_terminal_saves_the_results(self):
        code = self.run_and_kill("hangup", 3, signal.SIGHUP)
        self.assertEqual(code, 130)
        self.assertTrue((self.folder / "hangup" / "summary.json").exists())
        self.assertFalse((self.folder / "hangup" / "run.journal").exists())

    def test_a_running_run_is_left_alone(self):
        out = self.folder / "running"
        process = subprocess.Popen([PROGRAM, *map(str, self.arguments(out.name, "--schedule", "realtime"))],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            while not (out / "run.journal").exists():
                time.sleep(0.05)
            time.sleep(2)
            self.assertIn("another run", stillmap("recover", out).stderr)
            elsewhere = stillmap("recover", out, "--out", self.folder / "so_far")
            self.assertIn(elsewhere.returncode, (0, 3), elsewhere.stderr)
        finally:
            process.wait()
        self.assertIn(process.returncode, (0, 3))

    def test_a_file_that_is_no_journal_is_refused(self):
        for source, words in ((self.folder / "whole", "has no journal"), (self.saved, "is not the journal")):
            refused = stillmap("recover", source, "--out", self.folder / "refused")
            self.assertEqual(refused.returncode, 1)
            self.assertIn(words, refused.stderr)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program")
    parser.add_argument("--kills", type=int, default=KILLS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--lost", type=float, default=LOST)
    arguments = parser.parse_args()
    PROGRAM, KILLS, SEED, LOST = os.path.abspath(arguments.program), arguments.kills, arguments.seed, arguments.lost
    unittest.main(argv=[sys.argv[0]], verbosity=2)
