#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests `stillmap batch`.

  batch_test.py PROGRAM    PROGRAM: file of the command
"""
import csv
import json
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

PROGRAM = None
COUNT = 3


def read(file):
    try:
        return file.read_bytes()
    except OSError:  # the process has ended
        return b""


def wait_until(condition):
    while not condition():
        time.sleep(0.01)


class Batch(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        for i in range(COUNT):
            cls.run_stillmap("simulate", "--frames", 20, "--people", 1, "--width", 160, "--height", 120, "--seed", i + 1,
                             "--out", cls.folder / "recordings" / f"visit_{i}")

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    @classmethod
    def run_stillmap(cls, *words):
        return subprocess.run([PROGRAM, *map(str, words)], cwd=cls.folder, capture_output=True, text=True, check=True)

    def setUp(self):
        self.out = self.folder / self.id().rpartition(".")[2]

    def batch(self, *words, code=0, out=None):
        command = [PROGRAM, "batch", *words, "--out", out or self.out]
        result = subprocess.run(list(map(str, command)), cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        return result.stdout + result.stderr

    def rows(self):
        with (self.out / "results.csv").open() as file:
            return list(csv.DictReader(file))

    def times(self):
        return [(self.out / f"visit_{i}" / "summary.json").stat().st_mtime_ns for i in range(COUNT)]

    def test_results_are_those_of_single_runs(self):
        self.batch("recordings/*", "--jobs", 2, "--set", "features.keypoints=600", "--set", "dense.stride=4")
        self.assertEqual([row["name"] for row in self.rows()], ["visit_0", "visit_1", "visit_2"])
        for row in self.rows():
            self.assertEqual((row["status"], row["frames"], row["with a pose"]), ("done", "20", "20"))
            self.assertLess(float(row["ATE [m]"]), 0.02)
            single = self.folder / "single" / row["name"]
            self.run_stillmap("run", row["recording"], "--quiet", "--out", single, "--set", "features.keypoints=600",
                              "--set", "dense.stride=4")
            for name in ("trajectory.txt", "cloud.ply", "run.map"):
                self.assertEqual((single / name).read_bytes(), (self.out / row["name"] / name).read_bytes(), name)
        self.assertIn("visit_0/report.html", (self.out / "results.html").read_text())

    def test_only_what_changed_is_mapped_again(self):
        self.batch("recordings/*")
        first = self.times()
        (self.out / "visit_0" / "notes.txt").write_text("mine")
        self.batch("recordings/*")
        self.assertEqual(self.times(), first)
        changed = self.folder / "recordings" / "visit_1" / "groundtruth.txt"
        text = changed.read_text()
        changed.write_text(text + "\n")
        self.batch("recordings/*")
        self.assertEqual([now == before for now, before in zip(self.times(), first)], [True, False, True])
        changed.write_text(text)
        (self.out / "visit_2" / "cloud.ply").unlink()
        before = self.times()
        self.batch("recordings/*")
        self.assertEqual([now == then for now, then in zip(self.times(), before)], [True, False, False])
        self.assertTrue((self.out / "visit_2" / "cloud.ply").exists())
        self.run_stillmap("run", "recordings/visit_0", "--out", self.out / "visit_0", "--stride", 2, "--quiet", "--force")
        before = self.times()
        self.batch("recordings/*")
        self.assertEqual([now == then for now, then in zip(self.times(), before)], [False, True, True])
        self.batch("recordings/*", "--preset", "static")
        self.assertTrue(all(now != then for now, then in zip(self.times(), before)))

    def test_a_failure_leaves_the_others(self):
        broken = self.folder / "broken"
        shutil.copytree(self.folder / "recordings" / "visit_0", broken, dirs_exist_ok=True)
        shutil.rmtree(broken / "rgb")
        output = self.batch("recordings/visit_1", "broken", code=1)
        self.assertEqual([row["status"] for row in self.rows()], ["done", "failed"])
        self.assertIn("jobs/broken.log", output)
        self.assertIn("broken", self.rows()[1]["findings or error"])
        self.assertIn('<a href="jobs/broken.log">broken</a>', (self.out / "results.html").read_text())
        self.assertIn("fix:", (self.out / "jobs" / "broken.log").read_text())

    def test_maps_are_merged(self):
        listed = self.folder / "list.txt"
        listed.write_text("# two visits\nrecordings/visit_[01]\n")
        self.batch("--list", listed, "--merge", "all.map")
        self.run_stillmap("map", "merge", self.out / "visit_0" / "run.map", self.out / "visit_1" / "run.map", "--out", "by_hand.map")
        self.assertEqual((self.folder / "all.map").read_bytes(), (self.folder / "by_hand.map").read_bytes())

    def test_many_are_localized_in_one_map(self):
        self.batch("recordings/visit_0")
        printed = self.batch("recordings/visit_0", "--load-map", self.out / "visit_0" / "run.map", "--localize-only",
                             out=self.out / "again")
        self.assertRegex(printed, r"visit_0 +done .*localized in component 0: 20")
        self.assertTrue((self.out / "again" / "visit_0" / "trajectory.txt").exists())
        self.assertIn("component 0: 20", (self.out / "again" / "results.csv").read_text())

    def test_recordings_of_one_name_have_folders_of_their_own(self):
        other = self.folder / "other" / "visit_0"
        shutil.copytree(self.folder / "recordings" / "visit_0", other)
        self.batch("recordings/visit_0", other)
        self.assertEqual([row["name"] for row in self.rows()], ["recordings_visit_0", "other_visit_0"])
        alike = shutil.copytree(other, self.folder / "deep" / other.parent.name / other.name)
        names = [Path(line).name for line in self.batch(other, alike, "--dry-run").splitlines()]
        self.assertEqual(names, [f"{self.folder.name}_other_visit_0", "deep_other_visit_0"])
        self.assertEqual(len(self.batch("recordings/visit_0", "recordings/visit_0/", "--dry-run").splitlines()), 1)
        for name in ("visit.bag", "visit.mcap"):
            (self.folder / name).touch()
        names = [Path(line).name for line in self.batch("visit.bag", "visit.mcap", "--dry-run").splitlines()]
        self.assertEqual(names, [f"{self.folder.name}_visit.bag", f"{self.folder.name}_visit.mcap"])

    def test_a_list_of_any_program(self):
        list_file = self.folder / "list.txt"
        list_file.write_bytes("\ufeff# recordings\r\n  recordings/visit_0  \r\n\r\nrecordings/visit_*\r\n".encode())
        shown = self.batch("--list", list_file, "--dry-run").splitlines()
        self.assertEqual([Path(line.split(" -> ")[0]).name for line in shown], ["visit_0", "visit_1", "visit_2"])

    def test_results_of_another_recording_are_kept(self):
        self.batch("recordings/visit_0", "--set", "dense.enabled=false")
        other = shutil.copytree(self.folder / "recordings" / "visit_1", self.folder / "tuesday" / "visit_0")
        self.assertIn("has the results of", self.batch(other, code=1))
        self.assertEqual(self.rows()[0]["recording"], "recordings/visit_0")

    def test_a_file_of_others_is_no_map_to_merge_into(self):
        notes = self.folder / "notes.txt"
        notes.write_text("mine")
        self.batch("recordings/visit_0", "recordings/visit_1", "--merge", notes, code=1)
        self.assertEqual(notes.read_text(), "mine")
        self.assertFalse((self.out / "visit_0").exists(), "before the first recording is mapped")

    def test_a_table_of_others_is_kept(self):
        self.out.mkdir()
        (self.out / "results.csv").write_text("mine")
        self.batch("recordings/visit_0", code=1)
        self.assertEqual((self.out / "results.csv").read_text(), "mine")
        self.assertFalse((self.out / "visit_0").exists(), "before the first recording is mapped")

    def test_names_are_addresses_in_the_page(self):
        shutil.copytree(self.folder / "recordings" / "visit_0", self.folder / "50 % #1", dirs_exist_ok=True)
        self.batch("50 % #1", "--set", "dense.enabled=false")
        self.assertIn('href="50%20%25%20%231/report.html"', (self.out / "results.html").read_text())

    def test_one_map_is_not_merged(self):
        self.assertIn("there is one map only", self.batch("recordings/visit_0", "--merge", "one.map", code=1))
        same = shutil.copytree(self.folder / "recordings" / "visit_0", self.folder / "same")
        output = self.batch("recordings/visit_0", same, "--merge", "one.map", code=1)
        self.assertIn("same is not merged: its map is that of visit_0", output)
        self.assertFalse((self.folder / "one.map").exists())
        loaded = self.out / "visit_0" / "run.map"
        self.batch("recordings/*", "--load-map", loaded, "--localize-only", "--merge", "one.map", out=self.out / "other", code=1)

    def test_a_file_of_others_among_the_results_is_kept(self):
        self.batch("recordings/visit_0")
        (self.out / "visit_0" / "mesh.ply").write_text("mine")
        self.batch("recordings/visit_0", "--mesh=ply", code=1)
        self.assertIn("mesh.ply", (self.out / "jobs" / "visit_0.log").read_text())
        self.assertEqual((self.out / "visit_0" / "mesh.ply").read_text(), "mine")

    def test_results_are_not_put_into_a_recording(self):
        recording = self.folder / "recordings" / "visit_0"
        for out in (recording, recording / "results"):
            self.assertIn("is in the recording", self.batch(recording, out=out, code=1))
            self.assertFalse((out / "jobs").exists())

    def test_a_killed_batch_leaves_no_program(self):
        long = self.folder / "long"
        self.run_stillmap("simulate", "--frames", 400, "--people", 0, "--width", 160, "--height", 120, "--out", long)
        process = subprocess.Popen([PROGRAM, "batch", long, "--out", self.out], stdout=subprocess.DEVNULL)
        running = lambda: [entry for entry in Path("/proc").glob("[0-9]*/cmdline") if str(self.out / "long").encode() in read(entry)]
        wait_until(running)
        process.kill()
        process.wait()
        wait_until(lambda: not running())
        summary = self.out / "long" / "summary.json"
        self.assertTrue(not summary.exists() or json.loads(summary.read_text())["frames"]["total"] < 400)
        self.batch(long)
        self.assertEqual(json.loads(summary.read_text())["frames"]["total"], 400)

    def test_wrong_words(self):
        self.assertIn("does not exist", self.batch("recordings/*", "--load-map", "no.map", code=1))
        self.assertIn("does not exist", self.batch("recordings/nothing", "--dry-run", code=1))
        self.assertIn("no recording has such a name", self.batch("nothing/*", code=1))
        self.assertIn("no recordings were named", self.batch(code=1))
        self.assertIn("did you mean", self.batch("recordings/*", "--preset", "fusd", code=1))
        self.assertFalse((self.out / "visit_0").exists())

    def test_scripts_of_slurm(self):
        output = self.batch("recordings/*", "--slurm=--partition=cpu", "--dry-run", "--stride", 2, "--merge", "it's.map")
        self.assertIn("sbatch --parsable --array=0-2 --partition=cpu ", output)
        self.assertIn("sbatch --dependency=afterany:$array --partition=cpu ", output)
        self.assertIn("'--stride' '2' --only $SLURM_ARRAY_TASK_ID", output)
        self.assertIn("it'\\''s.map'", output)
        self.assertIn(f"cd '{self.folder}'", output)
        for script in (self.out / "jobs").glob("*.sh"):
            subprocess.run(["sh", "-n", script], check=True)
        self.assertFalse((self.out / "visit_0").exists())


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
