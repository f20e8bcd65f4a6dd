#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Every subcommand of the laboratory once, on a tiny rendered sequence.

  lab/smoke_test.py STILLMAP STILLMAP_LAB     the two built programs
"""
import importlib.util
import json
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
STILLMAP = STILLMAP_LAB = Path()


class Smoke(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.sequences = cls.folder / "sequences"
        cls.sequence = cls.sequences / "office"
        done = subprocess.run([STILLMAP, "simulate", "--people", "1", "--camera", "loop", "--frames", "50", "--fps", "10",
                               "--width", "320", "--height", "240", "--out", cls.sequence],
                              capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def output_of(self, *command):
        done = subprocess.run([str(word) for word in command], cwd=ROOT, capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def program(self, *words):
        """Output of a subcommand of stillmap_lab."""
        return self.output_of(STILLMAP_LAB, *words)

    def module(self, *words):
        """Output of a subcommand of the Python module."""
        return self.output_of(sys.executable, "-m", "lab", *words)

    def test_occlusion(self):
        printed = self.program("occlusion", "--camera", "xyz", "--share", "1", "--seconds", "1", "--frames", "45",
                               "--from", "10")
        self.assertRegex(printed, r"1\.0 1 +\d+ of +30 .* of 45 ")

    def test_kidnap(self):
        printed = self.program("kidnap", "--mapped", "110", "--visits", "1", "--end", "112")
        self.assertRegex(printed, r"known +place, frame +20: ")
        self.assertIn("uncovered frames have a pose", printed)

    def test_kidnap_scattered(self):
        self.assertRegex(self.program("kidnap", "--scattered", "--pieces", "2"), r"\d+ joins and loops, 0 wrong")

    def test_loop_cost(self):
        printed = self.program("loop-cost", self.sequence, "--realtime", "0")
        self.assertRegex(printed, r"with loops: ATE 0\.0\d+ m, 50 of 50 frames tracked")

    def test_long_run(self):
        printed = self.program("long-run", self.sequence, "--out", self.folder / "long", "--frames", "150")
        self.assertEqual(len(re.findall(r"^\| \d+ ", printed, re.MULTILINE)), 10)
        self.assertRegex(printed, r"with a pose: 1[45]\d of 150; dropped: 0")
        self.assertRegex(printed, r"ATE RMSE 0\.0\d+ m")

    def test_large_map(self):
        printed = self.program("large-map", "--out", self.folder / "large", "--views", "12", "--memory", "2")
        self.assertRegex(printed, r"(?m)^\| add 12 views of 0\.46 MB \|.*\| 1\.8 \| 8 \|$")
        self.assertRegex(printed, r"(?m)^\| load \|.*\| 1\.8 \| 8 \|$")
        self.assertIn("fuse again: the same cloud", printed)

    def test_merge_scale(self):
        """Components are adjusted while they grow: 15 mm, and 24 mm if only at the end."""
        row = self.program("merge-scale", "--maps", "30").splitlines()[2].split("|")
        self.assertEqual([float(row[i]) for i in (1, 2, 5, 6)], [30, 360, 1, 100])
        self.assertLess(float(row[7]), 20)

    def test_loop_precision(self):
        self.assertRegex(self.program("loop-precision", self.sequence), r"all: \d+ candidates")

    def test_place_recall(self):
        self.assertRegex(self.program("place-recall", self.sequence), r"pairs: \d+ of \d+ show the same place")

    def test_read(self):
        self.assertRegex(self.program("read", self.sequence), r"MB, 50 frames; opened in .* images/s")

    def test_speeds(self):
        speeds = self.folder / "speeds"
        self.program("speeds", self.sequence, speeds)
        self.assertEqual(len(list(speeds.glob("*.png"))), 50)

    def test_detect_without_a_network(self):  # with one: networks/export_test.py
        done = subprocess.run([STILLMAP_LAB, "detect", self.sequence / "rgb/0.000000.png", "--model", "gone.onnx"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("gone.onnx: there is no such network file", done.stderr)

    def test_vocabulary(self):
        out = self.folder / "vocabulary.bin"
        printed = self.program("vocabulary", self.sequence / "rgb", "--branching", "4", "--depth", "2", "--out", out)
        self.assertRegex(printed, r"16 words of 50 images")
        self.assertGreater(out.stat().st_size, 16 * 32)

    def test_brief_pattern(self):
        printed = self.program("brief-pattern", "--images", "1", "--candidates", "500", "--tests", "8")
        self.assertEqual(len([line for line in printed.splitlines() if line.startswith("{")]), 8)

    def test_masks_without_a_network(self):
        done = subprocess.run([STILLMAP_LAB, "masks", self.sequence, self.folder / "masks", "--model", "gone.onnx"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("gone.onnx", done.stderr)

    def test_surface(self):
        python = ROOT / "build/surface_venv/bin/python"
        if not python.exists():
            self.skipTest("skipped: there is no build/surface_venv with Open3D")
        self.output_of(python, "-m", "unittest", "lab.lab_test.Surface")
        printed = self.output_of(python, "-m", "lab", "surface", self.sequence, "--out", self.folder / "surface", "--program",
                                 STILLMAP, "--lab-program", STILLMAP_LAB)
        self.assertEqual(len(re.findall(r"(?m)^\| office \| (?:Stillmap|Open3D) .* \| \d+ \| \d+ \| \d+\.\d, ", printed)), 5)

    def test_starts(self):
        out = self.folder / "starts"
        printed = self.module("starts", self.sequences, "--presets", "static", "--starts", "2", "--out", out,
                              "--program", STILLMAP)
        self.assertRegex(printed, r"\| office \| static \| 0\.\d{4} 0\.\d{4} \| 0\.\d{4}; 0\.\d{4} \|")
        row = json.loads((out / "starts.json").read_text(encoding="utf-8"))["rows"][0]
        self.assertEqual((row["not_tracked"], len(row["ate_rmse_m"])), ([0, 0], 2))
        self.assertGreater(row["nees"], 0)

    def test_hashes_of_two_runs_are_the_same(self):
        words = ["hashes", self.sequences, "--presets", "fused", "--count", "15", "--program", STILLMAP]
        self.module(*words, "--out", self.folder / "first")
        printed = self.module(*words, "--out", self.folder / "second", "--compare", self.folder / "first/hashes.json")
        self.assertIn("All are the same", printed)
        runs = json.loads((self.folder / "first/hashes.json").read_text(encoding="utf-8"))
        self.assertNotIn(None, runs["office, fused-no-network"].values())

    def test_sequences(self):
        printed = self.module("sequences", self.sequences, "--presets", "static", "--out", self.folder / "sequences_out",
                              "--ghosts", "--program", STILLMAP, "--lab-program", STILLMAP_LAB)
        self.assertRegex(printed, r"\| office \| static \| 0\.\d{4} \|")
        self.assertIn("ghosts [%]", printed)
        self.assertIn("precision", printed)

    def test_findings(self):
        out = self.folder / "findings"
        printed = self.module("findings", self.sequences, "--pieces", "40", "--wrong-step", "50", "--out", out,
                              "--program", STILLMAP)
        self.assertRegex(printed, r"\| depth-factor \| 0 \| 1 \| 1 \|")
        good = json.loads((out / "findings.json").read_text(encoding="utf-8"))[0]
        self.assertEqual((good["variant"], good["findings"]), ("good", {}))

    def test_calibrations(self):
        out = self.folder / "calibrations"
        printed = self.module("calibrations", self.sequences, "--pieces", "5", "--lengths", "20", "--frames", "20", "--width", "320",
                              "--out", out, "--program", STILLMAP)
        self.assertRegex(printed, r"\| rendered, fx \| 4 \| \d+ % \|")
        pieces = json.loads((out / "calibrations.json").read_text(encoding="utf-8"))
        self.assertEqual([len(piece["parameters"]) for piece in pieces], [8] * 5)

    def test_growth(self):
        out = self.folder / "growth"
        printed = self.module("growth", "--out", out, "--rounds", "1", "--program", STILLMAP)
        self.assertEqual((out / "growth.md").read_text(encoding="utf-8") + "\n", printed)
        self.assertEqual(json.loads((out / "growth.json").read_text(encoding="utf-8"))[0]["rounds"], 1)

    def test_growth_by_visits(self):
        out = self.folder / "visits"
        printed = self.module("growth", "--out", out, "--visits", "2", "--frames", "60", "--program",
                              STILLMAP)
        self.assertEqual((out / "visits.md").read_text(encoding="utf-8") + "\n", printed)
        first, second = json.loads((out / "visits.json").read_text(encoding="utf-8"))
        self.assertEqual((first["components"], second["components"]), (1, 1), "the second visit extends the map of the first")
        self.assertGreater(second["views"], first["views"])
        if importlib.util.find_spec("numpy"):
            printed = self.module("judge", "appeared", out / "run_of_visit_0_1", out / "visit_0_1")
            self.assertRegex(printed, r"\w+: \d+\.\d % of \d+ visible points")

    @unittest.skipUnless(importlib.util.find_spec("scipy"), "needs scipy")
    def test_covariances(self):
        run = self.folder / "covariances"
        subprocess.run([STILLMAP, "run", self.sequences / "office", "--out", run, "--quiet"], check=True, capture_output=True)
        printed = self.module("covariances", run, self.sequences / "office")
        rows = re.findall(r"\| (\d+\.\d), (\d+\.\d) \| \d\.\d{3}, \d\.\d{3} \|", printed)
        self.assertTrue(rows, printed)
        for error, stated in rows:
            self.assertLess(float(error), 10)
            self.assertGreater(float(stated), 0)

    def test_merging(self):
        out = self.folder / "merging"
        printed = self.module("merging", self.sequences, "--length", "20", "--most", "2", "--orders", "1", "--out", out,
                              "--program", STILLMAP)
        self.assertEqual((out / "merging.md").read_text(encoding="utf-8") + "\n", printed)
        totals = json.loads((out / "merging.json").read_text(encoding="utf-8"))["totals"]
        self.assertEqual((totals["of these connected"], totals["other bytes"]), (0, "0 of 1 orders"))

    def test_maps(self):
        printed = self.module("maps", self.sequences, "office:office", "--preset", "static", "--out",
                              self.folder / "maps", "--program", STILLMAP)
        self.assertRegex(printed, r"\| office \| office \| \d+/50 \|")

    def test_view(self):
        out = self.folder / "view"
        printed = self.module("view", self.sequence, "--schedule", "lockstep", "--count", "30", "--points", "", "--out", out,
                              "--program", STILLMAP)
        for clients in ("no view", "0", "1", "5"):
            self.assertRegex(printed, rf"\| {clients} \| \d+\.\d \|")
        runs = json.loads((out / "view.json").read_text(encoding="utf-8"))["runs"]
        self.assertGreater(runs[-1]["kib_per_s"], 0)

    def test_zones(self):
        out = self.folder / "zones"
        words = ["zones", "--scenes", "office", "--seeds", "1", "--frames", "40", "--out", out, "--program", STILLMAP]
        printed = self.module(*words)
        for segmentation in ("masks", "no network"):
            self.assertRegex(printed, rf"\| office \| {segmentation} \| \d+ of \d+ \| \d+ of \d+ \|")
        rows = json.loads((out / "zones.json").read_text(encoding="utf-8"))
        self.assertGreater(rows[0]["true"], 0)
        self.assertEqual(self.module(*words), printed)

    def test_bench(self):
        out = self.folder / "bench"
        printed = self.module("bench", self.sequence, "--runs", "1", "--binary", STILLMAP, "--out", out)
        for row in ("tracking, median [ms]", "of the median: pose [ms]", "dense map, a keyframe folded in, CPU [ms]"):
            self.assertIn(f"| {row} |", printed)
        self.assertNotIn("Failed", printed)


if __name__ == "__main__":
    STILLMAP, STILLMAP_LAB = (Path(word).resolve() for word in sys.argv[1:3])
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
