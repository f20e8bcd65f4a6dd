#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The experiments of the papers on a small simulated recording with the name of one of their sequences.

  apps/reproduce_test.py PROGRAM     PROGRAM: the built command
"""
import json
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = ""
ROOT = Path(__file__).resolve().parent.parent
PAGES = [ROOT / "docs/papers.md", ROOT / "lab/records/papers_tables.md"]


def stillmap(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False)


class Reproduce(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.data = cls.folder / "data"
        cls.sequence = cls.data / "fr3_walking_xyz"
        made = stillmap("simulate", "--people", 1, "--frames", 12, "--width", 320, "--height", 240, "--out", cls.sequence)
        assert made.returncode == 0, made.stderr
        for yard, movers, near in (("yard_static", 0, []), ("yard_dynamic", 2, []), ("yard_loaded", 1, ["--near-objects"])):
            made = stillmap("simulate", "--scene", "yard", "--camera", "trolley", "--people", movers, "--objects", movers,
                            "--camera-model", "realsense_d435i", "--width", 320, "--fps", 15, "--frames", 12, *near,
                            "--out", cls.data / yard)
            assert made.returncode == 0, made.stderr
        cls.out = cls.folder / "out"
        cls.done = stillmap("reproduce", "all", "--data", cls.data, "--sequences", "walking_xyz", "--true-masks", "--runs",
                            2, "--out", cls.out)
        assert cls.done.returncode == 0, cls.done.stderr
        cls.crane_out = cls.folder / "crane"
        crane = stillmap("reproduce", "crane", "--data", cls.data, "--runs", 2, "--maps", "--out", cls.crane_out)
        assert crane.returncode == 0, crane.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def refused(self, code, *words, arguments):
        result = stillmap("reproduce", *arguments, "--out", self.folder / "refused")
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)

    def figures(self, paper, out=None):
        return json.loads(((out or self.out) / f"{paper}.json").read_text())

    def test_every_preset_runs_as_often_as_wanted_and_only_once_for_all_papers(self):
        runs = [sorted(run.name for run in (out / "runs").iterdir()) for out in (self.out, self.crane_out)]
        presets = ("box-epipolar", "box-flow", "fused", "gated-seg", "orb-rgbd", "seg-mask")
        papers = [f"walking_xyz_{preset}_{first}" for preset in presets for first in (0, 1)]
        crane = [f"{yard}_{preset}_{first}" for yard in ("yard_dynamic", "yard_loaded", "yard_static")
                 for preset in presets for first in (0, 1)]
        self.assertEqual(runs, [papers, crane])

    def test_the_figures_are_those_of_eval_averaged_over_the_runs(self):
        errors = []
        for first in (0, 1):
            run = self.out / f"runs/walking_xyz_seg-mask_{first}/trajectory.txt"
            shown = stillmap("eval", self.sequence / "groundtruth.txt", run, "--json", "-")
            errors.append(json.loads(shown.stdout)["ate"]["translation_m"]["rmse"])
        table = self.figures("seg-mask")["tables"][0]
        row = next(row for row in table["rows"] if (row["sequence"], row["statistic"]) == ("walking_xyz", "RMSE"))
        self.assertAlmostEqual(row["seg-mask"], sum(errors) / 2, delta=1e-7)
        improved = 100 * (row["orb-rgbd"] - row["seg-mask"]) / row["orb-rgbd"]
        self.assertAlmostEqual(row["seg-mask improved [%]"], improved, delta=1e-6)
        self.assertEqual(row["published: SLAM3-YOLOv8"], 0.013)

    def test_tables_are_written_in_three_formats_and_printed(self):
        for paper in ("seg-mask", "box-flow", "gated-seg", "box-epipolar"):
            markdown = (self.out / f"{paper}.md").read_text()
            latex = (self.out / f"{paper}.tex").read_text()
            for table in self.figures(paper)["tables"]:
                self.assertIn(f"**{table['title']}**", markdown)
                self.assertIn(f"**{table['title']}**", self.done.stdout)
            self.assertEqual(latex.count("\\begin{tabular}"), latex.count("\\end{tabular}"))
            self.assertEqual(latex.count("\\begin{tabular}"), len(self.figures(paper)["tables"]))

    def test_the_tables_of_a_paper_are_printed_before_the_next_paper_is_run(self):
        shown = self.done.stdout
        places = [shown.index(text) for text in (
            "walking_xyz, orb-rgbd, from frame 0", "walking_xyz, seg-mask, from frame 1", "# seg-mask (",
            "walking_xyz, box-flow, from frame 0", "# box-flow (")]
        self.assertEqual(places, sorted(places))
        self.assertRegex(shown, r"walking_xyz, seg-mask, from frame 0: ATE RMSE .* \[5/12, about .* left\]")
        row = self.figures("seg-mask")["tables"][-1]["rows"][0]
        self.assertGreater(row["seg-mask, tracking [ms]"], 0)
        self.assertGreater(row["seg-mask, whole system [ms]"], row["seg-mask, tracking [ms]"])

    def test_the_figure_of_the_trajectories_is_an_image(self):
        image = (self.out / "seg-mask_trajectories.png").read_bytes()
        self.assertEqual(image[:8], b"\x89PNG\r\n\x1a\n")
        self.assertEqual(int.from_bytes(image[16:20], "big"), 3 * 640)  # one panel per preset
        self.assertIn("orb-rgbd, walking_xyz", (self.out / "seg-mask_trajectories.svg").read_text())

    def test_missing_sequences_are_listed_with_their_origin(self):
        missing = self.figures("box-flow")["missing_sequences"]
        self.assertEqual(missing, ["sitting_xyz", "walking_halfsphere"])
        self.assertIn("rgbd_dataset_freiburg3_sitting_xyz, https://", self.done.stdout)

    def test_presets_that_need_a_network_are_left_out_without_one(self):
        out = self.folder / "without"
        done = stillmap("reproduce", "seg-mask", "--data", self.data, "--sequences", "walking_xyz", "--runs", 1, "--frames", 6,
                        "--out", out)
        self.assertEqual(done.returncode, 3, done.stderr)  # the paper's preset was not run
        self.assertIn("no preset of a paper was run", done.stderr)
        self.assertIn("none was named (--model FILE.onnx, or --model PRESET=FILE.onnx): seg-mask\n", done.stdout)
        figures = self.figures("seg-mask", out)
        self.assertEqual(figures["presets_left_out"], ["seg-mask"])
        self.assertEqual([run["preset"] for run in figures["runs"]], ["orb-rgbd", "fused"])
        self.assertEqual([run["coverage"]["total"] for run in figures["runs"]], [6, 6])

    def test_the_crane_compares_closure_errors_of_all_yards(self):
        crane = self.figures("crane", self.crane_out)
        rows = crane["tables"][0]["rows"]
        self.assertEqual([(row["sequence"], row["preset"]) for row in rows],
                         [(yard, preset) for yard in ("yard_dynamic", "yard_loaded", "yard_static")
                          for preset in ("orb-rgbd", "seg-mask", "box-flow", "gated-seg", "box-epipolar", "fused")])
        closures = []
        for first in (0, 1):
            run = self.crane_out / f"runs/yard_static_orb-rgbd_{first}/trajectory.txt"
            shown = stillmap("eval", self.data / "yard_static/groundtruth.txt", run, "--closure", "--planar", "--json", "-")
            self.assertIn("closure error in plane", shown.stderr)
            closures.append(json.loads(shown.stdout)["closure"])
        static = next(row for row in rows if (row["sequence"], row["preset"]) == ("yard_static", "orb-rgbd"))
        for column, key in (("closure in the plane [m]", "plane_m"), ("closure in space [m]", "space_m")):
            self.assertAlmostEqual(static[column], sum(closure[key] for closure in closures) / 2, delta=1e-6)
        self.assertIn("Figure 9", crane["tables"][0]["notes"][0])
        self.assertTrue((self.crane_out / "crane_trajectories.png").exists())
        self.assertGreater(static["points of the map"], 0)
        self.assertTrue((self.crane_out / "runs/yard_loaded_seg-mask_0/cloud_before_after.png").exists())

    def test_variants_and_other_systems_are_columns(self):
        out, others = self.folder / "columns", self.folder / "others"
        others.mkdir(exist_ok=True)
        for number in (1, 2):
            shutil.copy(self.sequence / "groundtruth.txt", others / f"walking_xyz_{number}.txt")
        done = stillmap("reproduce", "gated-seg", "--data", self.data, "--sequences", "walking_xyz", "--true-masks", "--runs",
                        2, "--variant", "no-eq9=gated-seg:map.landmark_rules=[]:tracking.min_inliers=20", "--baseline",
                        f"perfect={others}", "--maps", "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        figures = self.figures("gated-seg", out)
        row = next(row for row in figures["tables"][0]["rows"] if row["sequence"] == "walking_xyz")
        self.assertLess(row["perfect"], 1e-6)  # the truth itself
        self.assertGreater(row["no-eq9"], 0)
        self.assertIn("Improvement rates are over perfect", figures["protocol"])
        self.assertEqual([run["first_frame"] for run in figures["runs"] if run["preset"] == "no-eq9"], [0, 1])
        options = (out / "runs/walking_xyz_no-eq9_0/options.yaml").read_text()
        self.assertIn("min_inliers: 20", options)
        summary = (out / "summary.md").read_text()
        for words in ("<!-- table: ate -->", "<!-- table: dynamic -->", "<!-- table: ghosts -->", "| perfect"):
            self.assertIn(words, summary)
        for image in ("cloud_before_after.png", "figures/sparse_map.png", "figures/dense_map.png"):
            self.assertTrue((out / "runs/walking_xyz_gated-seg_0" / image).exists(), image)

    def test_the_crane_has_columns_for_variants_and_other_systems(self):
        out, others = self.folder / "crane_columns", self.folder / "crane_others"
        others.mkdir(exist_ok=True)
        shutil.copy(self.data / "yard_static/groundtruth.txt", others / "yard_static.txt")
        done = stillmap("reproduce", "crane", "--data", self.data, "--runs", 1, "--variant",
                        "no-eq9=gated-seg:map.landmark_rules=[]", "--baseline", f"perfect={others}", "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        rows = {row["preset"]: row for row in self.figures("crane", out)["tables"][0]["rows"]
                if row["sequence"] == "yard_static"}
        self.assertGreater(rows["no-eq9"]["closure in the plane [m]"], 0)
        self.assertLess(rows["perfect"]["closure in the plane [m]"], 1e-6)
        self.assertIsNone(rows["perfect"]["tracking [ms]"])
        self.assertIn("perfect has no trajectory of ", done.stdout)
        self.assertIn("perfect", {row["system"] for row in self.figures("crane", out)["tables"][1]["rows"]})

    def test_the_documents_name_tables_that_the_command_makes(self):
        data, out = self.folder / "slow", self.folder / "all_tables"
        made = stillmap("simulate", "--people", 1, "--frames", 12, "--fps", 10, "--width", 320, "--height", 240, "--out",
                        data / "walking_xyz")  # longer than the second of the RPE
        self.assertEqual(made.returncode, 0, made.stderr)
        done = stillmap("reproduce", "all", "--data", data, "--true-masks", "--runs", 1, "--maps", "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        pattern = re.compile("<!-- table: (\\S+) -->")
        results = (out / "summary.md", self.crane_out / "crane.md")
        made = {name for file in results for name in pattern.findall(file.read_text())}
        named = {name for page in PAGES for name in pattern.findall(page.read_text())}
        self.assertTrue(named)
        self.assertLessEqual({name.split("/", 1)[1] for name in named}, made)
        files = re.findall("<!-- file: (\\S+) -->", PAGES[1].read_text())
        self.assertTrue(files)
        for file in files:
            self.assertTrue((out / file.split("/", 1)[1]).exists(), file)

    def test_columns_that_cannot_be_made_are_refused(self):
        some = ["gated-seg", "--data", self.data, "--sequences", "walking_xyz"]
        self.refused(1, "NAME=PRESET", arguments=[*some, "--variant", "gated-seg"])
        self.refused(1, "there is another column 'fused'", arguments=[*some, "--variant", "fused=gated-seg"])
        self.refused(1, "no-such", arguments=[*some, "--variant", "a=no-such"])
        self.refused(1, "there is no such folder", arguments=[*some, "--baseline", "ORB-SLAM3=nowhere"])
        own = self.folder / "own"
        own.mkdir(exist_ok=True)
        shutil.copy(self.sequence / "groundtruth.txt", own / "walking_xyz.txt")
        self.refused(1, "there is another column 'fused'", arguments=[*some, "--baseline", f"fused={own}"])
        self.refused(1, "there is another column 'x'",
                     arguments=[*some, "--baseline", f"x={own}", "--baseline", f"x={own}"])
        self.refused(1, "whole sequences", arguments=[*some, "--baseline", f"x={own}", "--frames", 6])
        (own / "walking_xyz.txt").write_text("no trajectory\n")
        self.refused(1, "walking_xyz.txt:1", "is not a number", arguments=[*some, "--baseline", f"x={own}"])
        self.refused(1, "contains no trajectory", "walking_xyz.txt", arguments=[*some, "--baseline", f"x={self.data}"])

    def test_a_run_that_fails_leaves_its_cells_empty_and_the_exit_code_tells_of_it(self):
        data, out = self.folder / "damaged", self.folder / "without_figures"
        shutil.copytree(self.sequence, data / "walking_xyz")
        truth = data / "walking_xyz/groundtruth.txt"
        truth.write_text("\n".join(truth.read_text().splitlines()[:5]) + "\n")  # of four or five poses
        done = stillmap("reproduce", "seg-mask", "--data", data, "--true-masks", "--runs", 4, "--frames", 5, "--out", out)
        self.assertEqual(done.returncode, 3, done.stdout + done.stderr)
        self.assertRegex(done.stderr, "the tables lack seg-mask on walking_xyz, since the run from frame 3 failed: ")
        figures = self.figures("seg-mask", out)
        self.assertIn("problem", next(run for run in figures["runs"] if run["first_frame"] == 3))
        self.assertIsNone(figures["tables"][0]["rows"][0]["seg-mask"])

    def test_an_interrupt_keeps_the_complete_runs_for_the_next_start(self):
        out = self.folder / "interrupted"
        arguments = ["reproduce", "seg-mask", "--data", str(self.data), "--sequences", "walking_xyz", "--true-masks", "--runs",
                     "3", "--out", str(out)]
        with subprocess.Popen([PROGRAM, *arguments], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            next(line for line in process.stdout if "[2/9" in line)
            process.send_signal(signal.SIGINT)
            shown = process.stdout.read()
        self.assertEqual(process.returncode, 130)
        self.assertIn("interrupted; the same command goes on", shown)
        self.assertFalse((out / "seg-mask.md").exists())
        done = stillmap(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertGreaterEqual(done.stdout.count(", of an earlier start]"), 2)
        first = (out / "seg-mask.json").read_bytes()
        again = stillmap(*arguments)
        self.assertEqual(again.stdout.count(", of an earlier start]"), 9)
        self.assertEqual((out / "seg-mask.json").read_bytes(), first)
        other = stillmap(*arguments, "--frames", 6)
        self.assertEqual(other.stdout.count(", of an earlier start]"), 0)

    def test_the_tables_name_the_detectors(self):
        self.assertIn("Detectors: seg-mask: masks", (self.out / "seg-mask.md").read_text())
        self.assertIn("masks", next(run for run in self.figures("seg-mask")["runs"] if run["preset"] == "seg-mask")["detector"])

    def test_true_masks_take_the_place_of_a_network(self):
        out = self.folder / "true_masks"
        done = stillmap("reproduce", "seg-mask", "--data", self.data, "--sequences", "walking_xyz", "--runs", 1, "--frames", 6,
                        "--true-masks", "--model", self.folder / "not_opened.onnx", "--out", out)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        row = self.figures("seg-mask", out)["tables"][0]["rows"][0]
        self.assertIsNotNone(row["seg-mask"])

    def test_what_cannot_be_reproduced_is_refused(self):
        self.refused(1, "--data DIR", arguments=["seg-mask"])
        self.refused(2, "seg-msk", arguments=["seg-msk", "--data", self.data])
        empty = self.folder / "empty"
        empty.mkdir(exist_ok=True)
        self.refused(1, "contains no sequence", "rgbd_dataset_freiburg3_walking_xyz",
                     arguments=["seg-mask", "--data", empty])
        broken = self.folder / "broken.onnx"
        broken.write_bytes(b"this is no network")
        some = ["--data", self.data, "--sequences", "walking_xyz"]
        self.refused(1, "broken.onnx", arguments=["seg-mask", *some, "--model", f"seg-mask={broken}"])
        self.refused(1, "nowhere.onnx", arguments=["seg-mask", *some, "--model", "nowhere.onnx"])
        self.refused(1, "'seg_mask' is no preset of this experiment", "did you mean 'seg-mask'",
                     arguments=["seg-mask", *some, "--model", f"seg_mask={broken}"])
        self.refused(1, "needs the whole round", arguments=["crane", "--frames", "60"])
        self.refused(1, "there is no recording 'walking_xy'", "'walking_xyz'",
                     arguments=["seg-mask", "--data", self.data, "--sequences", "walking_xy"])


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv.pop()).resolve())
    unittest.main()
