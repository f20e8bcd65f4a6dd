#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of bench.py with fake mapping programs."""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parent / "bench.py"

# Writes its command lines, after its own name, to calls.txt, and results as `stillmap` does. Its n-th run tracks in n
# times the milliseconds that a file beside it says. A file `broken` lets profiled runs fail; `drifting` makes every
# trajectory another.
PROGRAM = r"""#!{python}
import json, sys
from pathlib import Path
program, words = Path(__file__), sys.argv[1:]
home = program.parent
with (home / "calls.txt").open("a") as calls:
    calls.write(" ".join([program.name, *words]) + "\n")
out = Path(words[words.index("--out") + 1])
out.mkdir(parents=True, exist_ok=True)
if words[0] == "simulate":
    sys.exit(0)
if "--profile" in words and (home / "broken").exists():
    print("no profile today")
    sys.exit(3)
counter = home / (program.name + ".runs")
n = int(counter.read_text()) + 1 if counter.exists() else 1
counter.write_text(str(n))
ms = n * float((home / (program.name + ".ms")).read_text())
(out / "trajectory.txt").write_text(str(n) if (home / "drifting").exists() else str("--model" in words))
stage = lambda name, ms: {{"name": name, "median_ms": ms, "p95_ms": 2 * ms, "p99_ms": 3 * ms, "max_ms": 4 * ms}}
(out / "summary.json").write_text(json.dumps({{
    "machine": "a machine, 2 cores", "timing_ms": [stage("tracking", ms), stage("features", ms / 2),
                                                   stage("pose", ms / 4)],
    "slowest_frame": {{"frame": 17, "ms": 4 * ms, "stages_ms": {{"features": ms / 2, "pose": 3.5 * ms}}}},
    "frames_per_second": 100 / ms, "peak_memory_mib": 100 + n, "first_pose_s": 0.1,
    "frames": {{"tracked": 9, "total": 10}}, "evaluation": {{"ate": {{"translation_m": {{"rmse": 0.002}}}}}}}}))
if "--profile" in words:
    call = lambda name, us: {{"name": name, "ph": "X", "tdur": us}}
    (out / "trace.json").write_text(json.dumps({{"traceEvents": [
        {{"name": "thread_name", "ph": "M"}}, call("dense map: keyframe", 11000), call("dense map: keyframe", 13000),
        call("dense map: keyframe", 12000)]}}))
"""


class Bench(unittest.TestCase):
    def setUp(self):
        self.holder = tempfile.TemporaryDirectory()
        self.addCleanup(self.holder.cleanup)
        self.home = Path(self.holder.name)
        (self.home / "one").mkdir()
        (self.home / "net.onnx").touch()
        self.program = self.add_program("program", 1)

    def add_program(self, name, milliseconds):
        program = self.home / name
        program.write_text(PROGRAM.format(python=sys.executable))
        program.chmod(0o755)
        (self.home / f"{name}.ms").write_text(str(milliseconds))
        return program

    def run_script(self, *words, programs=None):
        """@return exit code, what was printed, bench.json, and the calls that this run made"""
        calls = self.home / "calls.txt"
        calls.write_text("")
        binaries = [word for program in programs or [self.program] for word in ("--binary", program)]
        done = subprocess.run([sys.executable, SCRIPT, "--out", self.home / "out", *binaries, *words],
                              capture_output=True, text=True, check=False)
        written = self.home / "out/bench.json"
        result = json.loads(written.read_text()) if written.exists() else None
        return done.returncode, done.stdout + done.stderr, result, calls.read_text().splitlines()

    def row(self, printed, heading):
        line = next(line for line in printed.splitlines() if line.startswith(f"| {heading} |"))
        return [word.strip() for word in line.strip("|").split("|")][1:]

    def test_figures_are_medians_over_the_runs_with_their_range(self):
        code, printed, result, _ = self.run_script(self.home / "one", "--runs", "3")
        self.assertEqual(code, 0, printed)
        # Three ways in three turns, every second turn backwards: "everything" is run 1, 6 and 7.
        self.assertEqual(self.row(printed, "tracking, median [ms]"), ["6.00 (1.00-7.00)", "<= 10"])
        self.assertEqual(self.row(printed, "tracking, max [ms]"), ["24.0 (4.0-28.0)", "<= 10"[:0]])
        self.assertEqual(self.row(printed, "memory at most, no network [MiB]"), ["106 (101-107)", "<= 400"])
        self.assertEqual(self.row(printed, "dense map, a keyframe folded in, CPU [ms]"), ["12.0", "<= 30"])
        self.assertEqual(self.row(printed, "ATE RMSE [m]")[0], "0.0020")
        self.assertEqual(result["sequences"]["one"]["stillmap"]["everything"][0]["tracking_p99_ms"], 3)
        self.assertEqual(printed.strip().count("no network [ms]"), 0, "there is none: the rows would say the same")

    def test_the_slowest_frame_is_told_with_the_stage_that_made_it(self):
        _, printed, result, _ = self.run_script(self.home / "one", "--runs", "1")
        self.assertIn("17 (4.0 ms: pose)", printed)
        self.assertEqual(result["sequences"]["one"]["stillmap"]["everything"][0]["slowest"]["frame"], 17)

    def test_every_turn_runs_all_ways_and_changes_their_order(self):
        _, _, _, calls = self.run_script(self.home / "one", "--runs", "2", "--model", self.home / "net.onnx")
        self.assertEqual(len(calls), 8)
        kinds = [("--model" in call, "dense_cloud=false" in call, "--profile" in call) for call in calls]
        self.assertEqual(kinds[:4], [(True, False, False), (True, True, False), (False, False, False),
                                     (True, False, True)])
        self.assertEqual(kinds[4:], kinds[3::-1])

    def test_two_programs_run_in_turns_and_their_ratio_is_shown(self):
        other = self.add_program("other", 2)
        code, printed, _, calls = self.run_script(self.home / "one", "--runs", "2", programs=[self.program, other])
        self.assertEqual(code, 0, printed)
        self.assertEqual([call.split()[0] for call in calls], ["program", "other"] * 3 + ["other", "program"] * 3)
        self.assertEqual(self.row(printed, "tracking, median [ms]"),
                         ["3.50 (1.00-6.00)", "7.00 (2.00-12.00)", "2.000", "<= 10"])

    def test_an_older_result_is_shown_beside(self):
        self.run_script(self.home / "one", "--runs", "1")
        (self.home / "out/bench.json").rename(self.home / "old.json")
        (self.home / "program.runs").unlink()
        (self.home / "program.ms").write_text("0.5")
        _, printed, _, _ = self.run_script(self.home / "one", "--runs", "1", "--compare", self.home / "old.json")
        self.assertEqual(self.row(printed, "tracking, median [ms]"), ["0.50", "1.00", "0.500", "<= 10"])

    def test_without_a_sequence_a_scene_is_rendered_once(self):
        code, printed, result, calls = self.run_script("--runs", "1")
        self.assertEqual(code, 0, printed)
        self.assertEqual([call.split()[1] for call in calls], ["simulate", "run", "run", "run"])
        self.assertEqual(list(result["sequences"]), ["office_walking"])
        self.assertNotIn("simulate", "".join(self.run_script("--runs", "1")[3]))

    def test_a_run_that_fails_is_told_and_keeps_nobody_from_going_on(self):
        (self.home / "broken").touch()
        code, printed, _, calls = self.run_script(self.home / "one", "--runs", "1")
        self.assertEqual(code, 1)
        self.assertEqual(len(calls), 3)
        self.assertIn("one, stillmap, profiled: exit code 3: no profile today", printed)
        self.assertEqual(self.row(printed, "tracking, median [ms]")[0], "1.00")

    def test_trajectories_that_differ_are_told(self):
        (self.home / "drifting").touch()
        code, printed, _, _ = self.run_script(self.home / "one", "--runs", "1")
        self.assertEqual(code, 1)
        self.assertIn("trajectories differ", printed)

    def test_a_program_that_is_not_there_is_an_error(self):
        code, printed, _, _ = self.run_script(self.home / "one", programs=[self.home / "none"])
        self.assertEqual(code, 2)
        self.assertIn("there is no", printed)


if __name__ == "__main__":
    unittest.main()
