#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The tables of the papers, and their experiments on small simulated recordings: lab/reproduce_test.py PROGRAM."""
import json
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from lab import core, paper_docs, reproduce  # pylint: disable=wrong-import-position
from lab.paper_tables import (PAPERS, Table, crane_table, improvement, paper_tables, published, rounded,  # pylint: disable=wrong-import-position
                              summary_tables)

PROGRAM = Path()


# ------------------------------------------------------------------------------------------------------ tables


def run_of(preset, sequence, rmse, sd=0.1, **figures):
    """Returns a run with these ATE statistics, and times that follow from them."""
    return {"preset": preset, "sequence": sequence, "first_frame": 0, "ate": {"translation_m": {"rmse": rmse, "sd": sd}},
            "coverage": {"share": 0.99}, "tracking_ms": {"mean": 10 * rmse}, "with_detector_ms": {"mean": 260 * rmse},
            "total_ms": {"mean": 40 * rmse}, **figures}


def some_runs():
    return [run_of("orb-rgbd", "walking_xyz", 0.3, 0.2), run_of("orb-rgbd", "walking_xyz", 0.5, 0.2),
            run_of("seg-mask", "walking_xyz", 0.01), run_of("seg-mask", "walking_xyz", 0.03),
            run_of("orb-rgbd", "kitchen_still", 0.002)]


def cell(table, sequence, column, statistic="RMSE"):
    return next(row for row in table.rows if row[:2] == [sequence, statistic])[table.columns.index(column)]


class PublishedFigures(unittest.TestCase):
    def rates(self, paper, table, statistic="rmse", beginning=""):
        return {sequence: improvement(*(published(table, sequence, paper[system], statistic) for system in ("baseline", "system")))
                for sequence in table["rows"] if sequence.startswith(beginning)}

    def test_give_the_improvement_rates_that_the_papers_print(self):
        compared = 0
        for paper in PAPERS.values():
            for table in paper["tables"]:
                for sequence, row in table["rows"].items():
                    self.assertIn(sequence, paper["sequences"])
                    for statistic, printed in zip(table["statistics"], row.get("improvement", [])):
                        self.assertAlmostEqual(self.rates(paper, table, statistic)[sequence], printed, delta=0.0051)
                        compared += 1
                    for system in table["systems"]:
                        self.assertEqual(len(row[system]), len(table["statistics"]))
        self.assertEqual(compared, 60)

    def test_of_the_improvement_tables_follow_from_the_ate_tables(self):
        for paper in PAPERS.values():
            for table in (table for table in paper["tables"] if table["measure"] == "ate_improvement"):
                rates = self.rates(paper, paper["tables"][0])
                for sequence in table["rows"]:  # the paper of box-flow prints 95.26 where its values give 95.267
                    self.assertAlmostEqual(published(table, sequence, paper["system"], "rmse"), rates[sequence], delta=0.0071)

    def test_of_the_abstracts_are_remarked_at_the_tables_from_which_they_follow(self):
        for preset, number, statistic, text in (
                ("seg-mask", "1", "rmse", "83.08"), ("seg-mask", "1", "sd", "83.36"), ("seg-mask", "2", "rmse", "42.97"),
                ("seg-mask", "2", "sd", "45.6"), ("seg-mask", "3", "rmse", "27.35"), ("seg-mask", "3", "sd", "28.92"),
                ("box-flow", "2", "rmse", "94.60"), ("box-flow", "2", "mean", "95.03"), ("box-epipolar", "1", "rmse", "96.5"),
                ("box-epipolar", "2", "rmse", "93")):
            table = next(table for table in PAPERS[preset]["tables"] if table["number"] == number)
            self.assertIn(f"{text} %", table["remark"])
            rates = [round(rate, 2) for rate in self.rates(PAPERS[preset], table, statistic, "walking_").values()]
            half_of_the_last_digit = 0.5 * 10 ** -len(text.partition(".")[2])
            self.assertAlmostEqual(sum(rates) / len(rates), float(text), delta=1.02 * half_of_the_last_digit)

    def test_of_box_flow_over_other_systems_are_means_of_ratios(self):
        table = PAPERS["box-flow"]["tables"][-1]
        for system, gain in (("DynaSLAM", 3.94), ("DS-SLAM", 3.68)):
            ratios = [row["improved algorithm"][0] / row[system][0] for row in table["rows"].values()]
            self.assertAlmostEqual(100 * (sum(ratios) / len(ratios) - 1), gain, delta=0.0051)


class Tables(unittest.TestCase):
    def test_average_the_runs_before_the_improvement_rate_is_computed(self):
        table = paper_tables(PAPERS["seg-mask"], some_runs())[0]
        self.assertEqual(str(cell(table, "walking_xyz", "seg-mask")), "0.0200 (0.0100 0.0300)")
        self.assertAlmostEqual(cell(table, "walking_xyz", "seg-mask improved [%]").value, 95)
        self.assertAlmostEqual(cell(table, "walking_xyz", "seg-mask improved [%]", "SD").value, 50)
        self.assertIsNone(cell(table, "walking_xyz", "fused").value)
        self.assertEqual(str(cell(table, "kitchen_still", "orb-rgbd")), "0.0020")
        self.assertEqual(str(cell(table, "kitchen_still", "published: ORB-SLAM3")), "-")
        self.assertEqual(cell(table, "walking_rpy", "published: DynaSLAM", "SD").value, 0.0206)

    def test_have_no_mean_over_other_starts_than_the_baselines(self):
        failed = {"preset": "seg-mask", "sequence": "walking_xyz", "first_frame": 2, "problem": "lost"}
        table = paper_tables(PAPERS["seg-mask"], [*some_runs(), failed])[0]
        self.assertIsNone(cell(table, "walking_xyz", "seg-mask").value)
        self.assertIsNone(cell(table, "walking_xyz", "seg-mask improved [%]").value)
        self.assertAlmostEqual(cell(table, "walking_xyz", "orb-rgbd").value, 0.4)

    def test_end_with_the_means_that_the_abstracts_report(self):
        runs = some_runs()
        for name in ("walking_halfsphere", "walking_rpy", "walking_static"):
            runs += [run_of("orb-rgbd", name, 0.4), run_of("seg-mask", name, 0.1)]
        errors, *_, times, costs = paper_tables(PAPERS["seg-mask"], runs)
        column = "improved, from the published [%]"
        self.assertEqual([str(cell(errors, "mean of walking_*", column, name)) for name in ("RMSE", "SD")], ["83.08", "83.35"])
        self.assertAlmostEqual(cell(errors, "mean of walking_*", "seg-mask improved [%]").value, (95 + 3 * 75) / 4)
        of_the_paper = ("mean of the paper's sequences", "published: SLAM3-YOLOv8", "mean")
        self.assertEqual(str(cell(times, *of_the_paper)), "18.08")
        self.assertIsNone(cell(times, "mean of the paper's sequences", "orb-rgbd", "mean").value, "sitting_static was not run")
        self.assertAlmostEqual(costs.rows[0][costs.columns.index("seg-mask, tracking with the detector [ms]")].value, 5.2)
        self.assertFalse([name for name in costs.columns if name.startswith("fused")], "was not run")

    def test_have_columns_for_other_systems_over_which_the_rates_may_be(self):
        other = {key: value for key, value in run_of("ORB-SLAM3", "walking_xyz", 0.2).items() if not key.endswith("_ms")}
        runs = some_runs() + [other | {"coverage": {"share": 0.2}}]
        tables = paper_tables(PAPERS["seg-mask"], runs, ["ORB-SLAM3"], "ORB-SLAM3")
        self.assertAlmostEqual(cell(tables[0], "walking_xyz", "seg-mask improved [%]").value, 90)
        self.assertIsNone(cell(tables[3], "walking_xyz", "ORB-SLAM3", "mean").value, "a time")
        notes = [note for note in tables[0].notes if "has poses for" in note]
        self.assertEqual([note[:61] for note in notes], ["ORB-SLAM3 has poses for 20.0 % of the frames of walking_xyz ("])

    def test_compare_improvement_rates_with_those_that_a_paper_prints(self):
        table = paper_tables(PAPERS["box-flow"], [*some_runs(), run_of("box-flow", "walking_xyz", 0.1)])[2]
        self.assertAlmostEqual(cell(table, "walking_xyz", "box-flow").value, 75)
        self.assertEqual(cell(table, "walking_xyz", "published: DS-SLAM").value, 92.6)
        self.assertNotIn("orb-rgbd", table.columns)

    def test_of_all_systems_show_median_and_worst(self):
        tables = summary_tables(some_runs() + [run_of("seg-mask", "walking_xyz", 0.011, highly_dynamic=0.25)])
        self.assertEqual(tables["ate"].columns, ["system", "walking_xyz", "kitchen_still"])
        self.assertEqual([str(cell) for cell in tables["ate"].rows[1]], ["seg-mask", "11.0; 30.0", "-"])
        self.assertAlmostEqual(tables["improvement"].rows[0][1].value, 100 * (1 - 0.017 / 0.4))
        self.assertAlmostEqual(tables["tracked"].rows[0][1].value, 99)

    def test_of_the_crane_compare_closure_errors(self):
        runs = [run_of("orb-rgbd", "yard_dynamic", 1, closure={"plane_m": plane, "plane_percent": 4, "space_m": 1})
                for plane in (0.5, 0.3)] + [run_of("seg-mask", "yard_dynamic", 1, closure={"plane_m": 0.1})]
        table = crane_table(PAPERS["seg-mask"], runs)
        self.assertEqual([str(cell) for cell in table.rows[0][1:6]], ["orb-rgbd", "0.4000 (0.5000 0.3000)", "-", "4.000", "1.0000"])
        self.assertEqual([str(cell) for cell in table.rows[1][2:4]], ["0.1000", "75.00"])
        self.assertIn("Figure 9", table.notes[0])

    def test_are_aligned_in_markdown_and_escaped_in_latex(self):
        table = Table("t", ["run", "gain [%]"], [["x|y_z", crane_table(PAPERS["seg-mask"], [run_of("a", "b", 1)]).rows[0][6]]])
        self.assertEqual(table.markdown(), "**t**\n\n| run    | gain [%] |\n|--------|---------:|\n| x\\|y_z |   1.0000 |\n")
        self.assertIn("run & gain [\\%] \\\\\n\\hline\nx|y\\_z & 1.0000 \\\\", table.latex())
        self.assertEqual([rounded((83.35 + 83.36) / 2, 2), rounded(-27.345, 2), rounded(83.3549, 2)], ["83.36", "-27.35", "83.35"])


class Sequences(unittest.TestCase):
    def test_have_the_benchmarks_names_and_short_ones(self):
        for folder in ("rgbd_dataset_freiburg3_walking_halfsphere", "fr3_walking_halfsphere", "freiburg3_w_half", "W_half"):
            self.assertEqual(reproduce.benchmark_name(folder), "walking_halfsphere", folder)
        for folder, name in (("fr3_s_static", "sitting_static"), ("rgbd_dataset_freiburg1_rpy", "fr1_rpy"),
                             ("rgbd_bonn_crowd", "bonn_crowd"), ("kitchen_still", "kitchen_still")):
            self.assertEqual(reproduce.benchmark_name(folder), name)
        for folder in ("rgbd_dataset_freiburg3_walking_xyz_validation", "fr3_office", "rgbd_dataset_freiburg1_xyz", "walking"):
            self.assertEqual(reproduce.benchmark_name(folder), "", folder)

    def test_of_the_papers_come_first_with_their_cameras(self):
        with tempfile.TemporaryDirectory() as data:
            for name in ("kitchen_still", "rgbd_bonn_crowd", "fr1_rpy", "fr3_s_xyz", "fr3_w_xyz", "my_recording"):
                (Path(data) / name).mkdir()
                for file in ("rgb.txt", "depth.txt", "groundtruth.txt"):
                    (Path(data) / name / file).touch()
            (Path(data) / "fr3_s_xyz/camera.yaml").touch()
            found = reproduce.find_sequences(Path(data), [])
            self.assertEqual([(s.name, *s.camera[1:]) for s in found], [
                ("walking_xyz", "tum_fr3"), ("sitting_xyz",), ("bonn_crowd",), ("fr1_rpy", "tum_fr1"), ("kitchen_still",)])
            named = reproduce.find_sequences(Path(data), ["my_recording", "walking_xyz"])
            self.assertEqual([s.name for s in named], ["my_recording", "walking_xyz"])
            with self.assertRaisesRegex(core.Failed, "no recording 'walking_xy'.*walking_xyz"):
                reproduce.find_sequences(Path(data), ["walking_xy"])


# -------------------------------------------------------------------------------------------------------- runs


def lab(*words):
    return subprocess.run([sys.executable, "-m", "lab", "reproduce", *map(str, words), "--program", PROGRAM], cwd=ROOT,
                          capture_output=True, text=True, check=False)


def simulated(folder, *words):
    subprocess.run([PROGRAM, "simulate", *words, "--frames", "12", "--width", "320", "--out", folder], capture_output=True, check=True)
    return folder


class Runs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.data, cls.out, cls.crane_out = (cls.folder / name for name in ("data", "out", "crane"))
        cls.sequence = simulated(cls.data / "fr3_walking_xyz", "--people", "1", "--height", "240", "--fps", "8")
        for yard, *words in (("static", "0"), ("dynamic", "1"), ("loaded", "1", "--near-objects")):
            simulated(cls.data / f"yard_{yard}", "--scene", "yard", "--camera", "trolley", "--camera-model", "realsense_d435i", "--fps",
                      "15", "--people", words[0], "--objects", *words)
        cls.some = ["--data", cls.data, "--sequences", "walking_xyz", "--runs", "1"]
        cls.done = lab("all", *cls.some[:-1], "2", "--true-masks", "--maps", "--out", cls.out)
        assert cls.done.returncode == 0, cls.done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def figures(self, paper, out=None):
        return json.loads(((out or self.out) / f"{paper}.json").read_text(encoding="utf-8"))

    def refused(self, code, text, *words):
        done = lab(*words, "--out", self.folder / "refused")
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertRegex(done.stderr, text)

    def test_figures_are_those_of_eval_averaged_over_the_runs(self):
        runs = sorted(run.name for run in (self.out / "runs").iterdir())
        presets = ("box-epipolar", "box-flow", "fused", "gated-seg", "orb-rgbd", "seg-mask")
        self.assertEqual(runs, [f"walking_xyz_{preset}_{first}" for preset in presets for first in (0, 1)])
        errors = []
        for first in (0, 1):
            shown = subprocess.run([PROGRAM, "eval", self.sequence / "groundtruth.txt",
                                    self.out / f"runs/walking_xyz_seg-mask_{first}/trajectory.txt", "--json", "-"],
                                   capture_output=True, text=True, check=False)
            errors.append(json.loads(shown.stdout)["ate"]["translation_m"]["rmse"])
        figures = self.figures("seg-mask")
        row = next(row for row in figures["tables"][0]["rows"] if row["sequence"] == "walking_xyz")
        self.assertAlmostEqual(row["seg-mask"], sum(errors) / 2, delta=1e-12)
        self.assertAlmostEqual(row["seg-mask improved [%]"], improvement(row["orb-rgbd"], row["seg-mask"]))
        costs = figures["tables"][-1]["rows"][0]
        self.assertGreater(costs["seg-mask, whole system [ms]"], costs["seg-mask, tracking [ms]"])
        self.assertGreater(costs["seg-mask, points of the dense map"], 0)

    def test_tables_are_written_in_three_formats_and_printed_with_missing_sequences(self):
        for paper in PAPERS:
            markdown = (self.out / f"{paper}.md").read_text(encoding="utf-8")
            for table in self.figures(paper)["tables"]:
                self.assertIn(f"**{table['title']}**", markdown)
            self.assertIn(markdown, self.done.stdout)
            self.assertIn("Detectors: ", markdown)
            latex = (self.out / f"{paper}.tex").read_text(encoding="utf-8")
            self.assertEqual(latex.count("\\end{tabular}"), len(self.figures(paper)["tables"]))
            chart = self.out / f"{paper}_trajectories/walking_xyz/comparison.svg"
            self.assertIn(paper, chart.read_text(encoding="utf-8"))
        self.assertEqual(self.figures("box-flow")["missing_sequences"], ["sitting_xyz", "walking_halfsphere"])
        self.assertIn("rgbd_dataset_freiburg3_sitting_xyz, https://", self.done.stdout)

    def test_the_documents_name_tables_that_are_made(self):
        done = lab("crane", "--data", self.data, "--runs", "1", "--out", self.crane_out)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = self.figures("crane", self.crane_out)["tables"][0]["rows"]
        self.assertEqual([(row["sequence"], row["preset"]) for row in rows],
                         [(yard, preset) for yard in ("yard_dynamic", "yard_loaded", "yard_static")
                          for preset in ("orb-rgbd", *PAPERS, "fused")])
        self.assertTrue((self.crane_out / "crane_trajectories/yard_static/comparison.html").exists())
        results = [file.read_text(encoding="utf-8") for file in (self.out / "summary.md", self.crane_out / "crane.md")]
        made = {found["name"] for text in results for found in paper_docs.TABLE.finditer(text)}
        pages = [(ROOT / page).read_text(encoding="utf-8") for page in paper_docs.PAGES]
        named = {found["name"].split("/", 1)[1] for text in pages for found in paper_docs.TABLE.finditer(text)}
        self.assertTrue(named)
        self.assertLessEqual(named, made)
        for found in (found for text in pages for found in paper_docs.FILE.finditer(text)):
            self.assertTrue((self.out / found["name"].split("/", 1)[1]).exists(), found["name"])

    def test_variants_and_other_systems_are_columns(self):
        out, others = self.folder / "columns", self.folder / "others"
        others.mkdir()
        for number in (1, 2):
            shutil.copy(self.sequence / "groundtruth.txt", others / f"walking_xyz_{number}.txt")
        done = lab("gated-seg", *self.some, "--true-masks", "--variant", "no-eq9=gated-seg:map.landmark_rules=[]:tracking.min_inliers=20",
                   "--baseline", f"perfect={others}", "--out", out)
        self.assertEqual(done.returncode, 0, done.stderr)
        row = next(row for row in self.figures("gated-seg", out)["tables"][0]["rows"] if row["sequence"] == "walking_xyz")
        self.assertLess(row["perfect"], 1e-6)  # the truth itself
        self.assertGreater(row["no-eq9"], 0)
        self.assertIn("Improvement rates are over perfect", self.figures("gated-seg", out)["protocol"])
        options = core.read_json(out / "runs/walking_xyz_no-eq9_0/summary.json")["options"]
        self.assertEqual((options["map"]["landmark_rules"], options["tracking"]["min_inliers"]), ([], 20))
        self.assertIn("| perfect ", (out / "summary.md").read_text(encoding="utf-8"))
        some = ["gated-seg", *self.some]
        for text, *words in (("NAME=PRESET", "--variant", "gated-seg"), ("another column 'fused'", "--variant", "fused=gated-seg"),
                             ("no-such", "--variant", "a=no-such"), ("no trajectory of these", "--baseline", "ORB-SLAM3=nowhere"),
                             ("another column 'fused'", "--baseline", f"fused={others}")):
            self.refused(1, text, *some, *words)
        (others / "walking_xyz.txt").write_text("no trajectory\n", encoding="utf-8")
        self.refused(1, "walking_xyz.txt:1.* is not a number", *some, "--baseline", f"x={others}")

    def test_presets_that_need_a_network_are_left_out_without_one(self):
        out = self.folder / "without"
        done = lab("seg-mask", *self.some, "--frames", "6", "--out", out)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("no preset of a paper was run", done.stderr)
        figures = self.figures("seg-mask", out)
        self.assertEqual(figures["presets_left_out"], ["seg-mask"])
        self.assertEqual([(run["preset"], run["coverage"]["total"]) for run in figures["runs"]], [("orb-rgbd", 6), ("fused", 6)])

    def test_a_run_that_fails_leaves_its_cells_empty(self):
        data, out = self.folder / "damaged", self.folder / "without_figures"
        shutil.copytree(self.sequence, data / "walking_xyz")
        truth = data / "walking_xyz/groundtruth.txt"
        truth.write_text("\n".join(truth.read_text(encoding="utf-8").splitlines()[:5]) + "\n", encoding="utf-8")
        done = lab("seg-mask", "--data", data, "--true-masks", "--runs", "4", "--frames", "5", "--out", out)
        self.assertEqual(done.returncode, 3, done.stdout + done.stderr)
        self.assertRegex(done.stderr, "the tables lack seg-mask on walking_xyz, since the run from frame 3 failed: ")
        self.assertIsNone(self.figures("seg-mask", out)["tables"][0]["rows"][0]["seg-mask"])

    def test_an_interrupt_keeps_the_complete_runs_for_the_next_start(self):
        out = self.folder / "interrupted"
        words = ["seg-mask", *self.some, "--true-masks", "--out", out]
        with subprocess.Popen([sys.executable, "-m", "lab", "reproduce", *map(str, words), "--program", PROGRAM], cwd=ROOT,
                              stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            next(line for line in process.stderr if ": ATE RMSE" in line)
            process.send_signal(signal.SIGINT)
            shown, _ = process.communicate()
        self.assertEqual(process.returncode, 130)
        self.assertIn("interrupted; the same command goes on", shown)
        self.assertFalse((out / "seg-mask.md").exists())
        self.assertLessEqual(len(re.findall(r" \.\.\.\n", lab(*words).stderr)), 2)
        first = (out / "seg-mask.json").read_bytes()
        self.assertNotIn(" ...\n", lab(*words).stderr)
        self.assertEqual((out / "seg-mask.json").read_bytes(), first)

    def test_what_cannot_be_reproduced_is_refused(self):
        empty = self.folder / "empty"
        empty.mkdir()
        network = self.folder / "network.onnx"
        network.touch()
        self.refused(1, "--data DIR", "seg-mask")
        self.refused(2, "seg-msk", "seg-msk", "--data", self.data)
        self.refused(1, "contains no sequence(.|\n)*rgbd_dataset_freiburg3_walking_xyz", "seg-mask", "--data", empty)
        self.refused(1, "nowhere.onnx", "seg-mask", *self.some, "--model", "nowhere.onnx")
        self.refused(1, "'seg_mask' is no preset of this experiment", "seg-mask", *self.some, "--model", f"seg_mask={network}")
        self.refused(2, "whole round", "crane", "--frames", "60")
        self.refused(2, "whole sequences", "seg-mask", *self.some, "--baseline", "x=y", "--frames", "6")


if __name__ == "__main__":
    PROGRAM = Path(sys.argv.pop()).resolve()
    unittest.main()
