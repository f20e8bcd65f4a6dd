# SPDX-License-Identifier: Apache-2.0
"""Tests of the laboratory with programs that only pretend to map: `python3 -m unittest lab.lab_test`."""
import hashlib
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

from lab import surface, zones

ROOT = Path(__file__).resolve().parent.parent


def call_lab(*words):
    return subprocess.run([sys.executable, "-m", "lab", *map(str, words)], cwd=ROOT, capture_output=True, text=True,
                          check=False)


# Writes its command lines to calls.txt in its folder, and results as `stillmap` and `stillmap_lab` do. ATE: 0.01 for
# static, 0.005 for fused, 0.02 without its history, and 0.001 more per first frame; fails with preset seg-mask as long
# as there is a file `broken` in its folder.
MAPPING_PROGRAM = r"""#!{python}
import json, sys
from pathlib import Path
home, words = Path(__file__).parent, sys.argv[1:]
with (home / "calls.txt").open("a") as calls:
    calls.write(" ".join(words) + "\n")
after = lambda word: words[words.index(word) + 1] if word in words else ""
if words[0] == "speeds":
    Path(words[2]).mkdir(parents=True)
    sys.exit(0)
if words[0] == "eval":
    figures = {{"motion_labels": {{"precision": {{"mean": 0.9}}, "recall": {{"mean": 0.8}}}},
                "ate_with_scale": {{"translation_m": {{"rmse": 0.004}}}},
                "rpe_1s": {{"translation_m": {{"rmse": 0.012 if "bonn" in words else 0.5}}}},
                "displacement": {{"error_m": {{"rmse": 0.0013, "max": 0.0042}}}}, "covariances": {{"nees": 6.2}}}}
    Path(after("--json")).write_text(json.dumps(figures))
    sys.exit(0)
preset, out = after("--preset"), Path(after("--out"))
if preset == "seg-mask" and (home / "broken").exists():
    print("the network is no network")
    sys.exit(1)
ate = {{"static": 0.01, "fused": 0.005}}.get(preset, 0.03)
if after("--set") == "motion.cues=residual,free-space,surface,semantic":
    ate = 0.02
ate += 0.001 * int(after("--first") or 0)
cues = ["residual", "history"] if preset == "fused" else []
out.mkdir(parents=True, exist_ok=True)
(out / "labels.bin").write_text("")
(out / "trajectory.txt").write_text("another" if (home / "drifting").exists() else "trajectory")
(out / "summary.json").write_text(json.dumps({{
    "evaluation": {{"ate": {{"translation_m": {{"rmse": ate, "sd": 0.001}}}},
                    "rpe_1s": {{"translation_m": {{"rmse": 0.011}}, "rotation_deg": {{"rmse": 0.4}}}}}},
    "frames": {{"tracked": 9, "total": 10}}, "tracking_median_ms": 7.5, "frames_per_second": 30,
    "peak_memory_mib": 100, "maps": 1, "landmarks": 500,
    "timing_ms": [{{"name": "motion: " + cue, "median_ms": 0.5}} for cue in cues]}}))
"""


def preset_of(call):
    words = call.split()
    return words[words.index("--preset") + 1]


class Mapping(unittest.TestCase):
    """Two sequences and a program that pretends to map them."""

    def setUp(self):
        self.holder = tempfile.TemporaryDirectory()
        self.addCleanup(self.holder.cleanup)
        self.home = Path(self.holder.name)
        for name in ("one", "two"):
            (self.home / "sequences" / name / "mask").mkdir(parents=True)
            (self.home / "sequences" / name / "groundtruth.txt").touch()
        self.program = self.home / "program"
        self.program.write_text(MAPPING_PROGRAM.format(python=sys.executable))
        self.program.chmod(0o755)
        self.model = self.home / "net.onnx"
        self.model.touch()

    def run_lab(self, subcommand, *words):
        """@return the finished process, and the calls of the program that it made"""
        calls = self.home / "calls.txt"
        calls.write_text("")
        model = ["--model", self.model] if self.model else []
        done = call_lab(subcommand, self.home / "sequences", "--out", self.home / "out", *model, "--program",
                        self.program, *words)
        return done, calls.read_text().splitlines()


class Sequences(Mapping):
    def run_script(self, *words):
        """@return exit code, standard output, the rows of table.json, and the calls that this run made"""
        done, calls = self.run_lab("sequences", "--lab-program", self.program, *words)
        rows = json.loads((self.home / "out/table.json").read_text())["runs"]
        return done.returncode, done.stdout, rows, calls

    def test_every_sequence_is_run_with_every_preset_and_judged(self):
        code, printed, rows, calls = self.run_script("--presets", "static,fused,fused-no-network")
        self.assertEqual(code, 0)
        self.assertEqual([(r["sequence"], r["preset"]) for r in rows],
                         [(s, p) for s in ("one", "two") for p in ("static", "fused", "fused-no-network")])
        self.assertEqual(rows[1]["ate_rmse_m"], 0.005)
        self.assertEqual((rows[1]["rpe_1s_m"], rows[1]["rpe_1s_deg"]), (0.011, 0.4))
        self.assertEqual((rows[1]["tracked"], rows[1]["frames"], rows[1]["tracking_median_ms"]), (9, 10, 7.5))
        self.assertEqual((rows[1]["precision"], rows[1]["recall"]), (0.9, 0.8))
        runs = [call for call in calls if call.startswith("run")]
        self.assertEqual([f"--model {self.model}" in call for call in runs], [False, True, False] * 2)
        self.assertEqual(sum(call.startswith("speeds") for call in calls), 2)  # once per sequence
        self.assertIn("| one | 0.0100 (9/10) | **0.0050** (9/10) |", printed)
        self.assertEqual((self.home / "out/table.md").read_text() + "\n", printed)

    def test_a_run_that_exists_is_not_repeated(self):
        self.run_script("--presets", "static")
        _, _, rows, calls = self.run_script("--presets", "static,fused")
        self.assertEqual([preset_of(c) for c in calls if c.startswith("run")], ["fused", "fused"])
        self.assertEqual(len(rows), 4)
        (self.home / "out/one_static/run.json").unlink()  # as after an interrupted run
        self.assertEqual(sum(c.startswith("run") for c in self.run_script("--presets", "static")[3]), 1)
        self.assertEqual(sum(c.startswith("run") for c in self.run_script("--presets", "static", "--again")[3]), 2)
        self.assertEqual(self.run_script("--presets", "static,fused", "--table")[3], [])
        self.assertEqual(self.run_script("--presets", "static", "--no-labels")[3], [])
        self.program.write_text(self.program.read_text() + "# another program\n")
        self.assertEqual(sum(c.startswith("run") for c in self.run_script("--presets", "static")[3]), 2)

    def test_a_failure_is_listed_and_tried_again_and_stops_no_other_run(self):
        (self.home / "broken").touch()
        code, printed, rows, _ = self.run_script("--presets", "seg-mask,fused")
        self.assertEqual(code, 1)
        self.assertEqual([r["error"] is not None for r in rows], [True, False] * 2)
        self.assertIn("- one, seg-mask: exit code 1: the network is no network", printed)
        self.assertEqual(self.run_script("--presets", "seg-mask,fused", "--table")[2], rows)
        (self.home / "broken").unlink()
        code, printed, rows, calls = self.run_script("--presets", "seg-mask,fused")
        self.assertEqual((code, [r["error"] for r in rows]), (0, [None] * 4))
        self.assertEqual([preset_of(c) for c in calls if c.startswith("run")], ["seg-mask", "seg-mask"])
        self.assertNotIn("ailed", printed)

    def test_a_failed_run_leaves_no_figures_of_an_older_one(self):
        self.run_script("--presets", "seg-mask")
        (self.home / "broken").touch()
        self.assertIsNone(self.run_script("--presets", "seg-mask", "--again")[2][0]["ate_rmse_m"])

    def test_ablation_leaves_out_each_cue_in_turn(self):
        _, printed, rows, _ = self.run_script("--presets", "static", "--ablate", "--only", "two")
        self.assertEqual([r["preset"] for r in rows],
                         ["static", "fused", "fused minus residual", "fused minus history"])
        self.assertEqual([r["ate_rmse_m"] for r in rows], [0.01, 0.005, 0.005, 0.02])
        self.assertIn("| fused | history | 0.500 | 0.500 |", printed)

    def test_figures_of_other_programs_get_columns(self):
        (self.home / "others.json").write_text('{"one": {"Peer": 0.0123}}')
        printed = self.run_script("--presets", "static", "--beside", str(self.home / "others.json"))[1]
        self.assertIn("| sequence | static | Peer |", printed)
        self.assertIn("| one | **0.0100** (9/10) | 0.0123 |", printed)
        self.assertIn("| two | **0.0100** (9/10) | - |", printed)


class Starts(Mapping):
    def test_the_median_and_the_worst_of_all_starts_are_tabulated(self):
        done, calls = self.run_lab("starts", "--presets", "fused,static", "--only", "one")
        self.assertEqual(done.returncode, 0, done.stderr)
        runs = [call.split() for call in calls if call.startswith("run")]
        self.assertEqual([words[words.index("--first") + 1] for words in runs], list("01234") * 2)
        self.assertIn("| one | fused | 0.0050 0.0060 0.0070 0.0080 0.0090 | 0.0070; 0.0090 | 0.0040 | 0.5000 | 1.3; 4.2 | 6.2 "
                      "| 1 1 1 1 1 |", done.stdout)
        self.assertIn("| 0.0120; 0.0140 |", done.stdout)
        rows = json.loads((self.home / "out/starts.json").read_text())["rows"]
        self.assertAlmostEqual(rows[0]["median_m"], 0.007)
        self.assertEqual(len(rows[0]["ate_rmse_m"]), 5)
        again = self.run_lab("starts", "--presets", "fused", "--only", "one")[1]
        self.assertFalse([call for call in again if call.startswith("run")], "runs are kept")

    def test_figures_of_the_camera_use_the_frame_of_the_truth(self):
        done, _ = self.run_lab("starts", "--presets", "static", "--only", "one", "--truth-frame", "one=bonn")
        self.assertIn("| 0.0120; 0.0140 | 0.0040 | 0.0120 |", done.stdout)

    def test_networks_are_compared_on_the_same_frames(self):
        other = self.home / "other.onnx"
        other.touch()
        done, calls = self.run_lab("starts", "--presets", "fused", "--only", "one", "--starts", "1", "--count", "300",
                                   "--networks", f"none,{self.model},{other}")
        self.assertEqual(done.returncode, 0, done.stderr)
        runs = [call for call in calls if call.startswith("run")]
        self.assertEqual([f"--model {network}" in run for run, network in zip(runs[1:], (self.model, other))], [True] * 2)
        self.assertNotIn("--model", runs[0])
        self.assertTrue(all("--count 300" in run for run in runs), runs)
        for name in ("fused-no-network", f"fused-{Path(self.model).stem}", "fused-other"):
            self.assertIn(f"| one | {name} |", done.stdout)

    def test_a_start_that_fails_is_listed(self):
        (self.home / "broken").touch()
        done, _ = self.run_lab("starts", "--presets", "seg-mask", "--only", "one", "--starts", "2")
        self.assertEqual(done.returncode, 1)
        self.assertIn("| one | seg-mask | - - | -; - | - | - | -; - | - | - - |", done.stdout)
        self.assertIn("- one, seg-mask: exit code 1", done.stdout)


class NoNetwork(Mapping):
    """Without --model the presets run without a network, and the tables say so."""

    def test_the_tables_name_the_runs_without_a_network(self):
        self.model = None
        for subcommand in ("starts", "hashes", "sequences"):
            words = ["--lab-program", self.program] if subcommand == "sequences" else []
            done, calls = self.run_lab(subcommand, "--presets", "fused,fused-no-network,static", "--only", "one", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertIn("fused-no-network", done.stdout)
            self.assertNotIn(" fused ", done.stdout)
            self.assertNotIn("--model", " ".join(calls))
            self.assertLessEqual({preset_of(call) for call in calls if call.startswith("run")}, {"fused", "static"})

    def test_a_network_that_is_missing_is_an_error(self):
        self.model.unlink()
        done, calls = self.run_lab("starts", "--presets", "fused")
        self.assertEqual((done.returncode, calls), (2, []))
        self.assertIn("there is no network", done.stderr)


class Judge(unittest.TestCase):
    def test_a_missing_file_is_named_with_the_command_that_writes_it(self):
        with tempfile.TemporaryDirectory() as folder:
            home = Path(folder)
            for subject in ("walls", "objects"):
                done = call_lab("judge", subject, home / "run", home)
                self.assertEqual(done.returncode, 1)
                self.assertIn("run/trajectory.txt: name a folder that `stillmap run --out", done.stderr)
                self.assertNotIn("Traceback", done.stderr)

    def test_damaged_files_are_an_error(self):
        with tempfile.TemporaryDirectory() as folder:
            home = Path(folder)
            for name in ("trajectory.txt", "semantic.ply", "objects.json", "groundtruth.txt", "things.csv"):
                (home / name).write_text("1 2 three\n")
            done = call_lab("judge", "objects", home, home)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, "damaged|numpy is missing")
            self.assertNotIn("Traceback", done.stderr)


class Hashes(Mapping):
    def test_a_result_that_changed_is_found(self):
        done, _ = self.run_lab("hashes")
        self.assertEqual(done.returncode, 0, done.stderr)
        digits = hashlib.sha256(b"trajectory").hexdigest()[:16]
        self.assertIn(f"| one, fused | {digits} | - | - | - |", done.stdout)
        old = self.home / "old.json"
        (self.home / "out/hashes.json").rename(old)
        done, calls = self.run_lab("hashes", "--again", "--compare", old)
        self.assertEqual((done.returncode, len(calls)), (0, 2))
        self.assertIn("All are the same", done.stdout)
        (self.home / "drifting").touch()
        done, _ = self.run_lab("hashes", "--again", "--compare", old)
        self.assertEqual(done.returncode, 1)
        self.assertIn("- two, fused: trajectory.txt differs", done.stdout)


# Writes its command lines, after its own name, to calls.txt, and results as `stillmap` does. Its n-th run tracks in n
# times the milliseconds in its file NAME.ms. A file `broken` makes profiled runs fail; `drifting` makes every
# trajectory different.
TIMED_PROGRAM = r"""#!{python}
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
    sys.exit(1)
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
        program.write_text(TIMED_PROGRAM.format(python=sys.executable))
        program.chmod(0o755)
        (self.home / f"{name}.ms").write_text(str(milliseconds))
        return program

    def run_script(self, *words, programs=None):
        """@return exit code, output, bench.json, and the calls that this run made"""
        calls = self.home / "calls.txt"
        calls.write_text("")
        binaries = [word for program in programs or [self.program] for word in ("--binary", program)]
        done = call_lab("bench", *words, "--out", self.home / "out", *binaries)
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

    def test_the_slowest_frame_is_shown_with_the_stage_that_caused_it(self):
        _, printed, result, _ = self.run_script(self.home / "one", "--runs", "1")
        self.assertIn("17 (4.0 ms: pose)", printed)
        self.assertEqual(result["sequences"]["one"]["stillmap"]["everything"][0]["slowest"]["frame"], 17)

    def test_every_turn_runs_all_arms_and_changes_their_order(self):
        _, _, _, calls = self.run_script(self.home / "one", "--runs", "2", "--model", self.home / "net.onnx")
        self.assertEqual(len(calls), 8)
        kinds = [("--model" in call, "dense.enabled=false" in call, "--profile" in call) for call in calls]
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

    def test_an_older_result_is_compared(self):
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

    def test_a_run_that_fails_is_listed_and_stops_no_other_run(self):
        (self.home / "broken").touch()
        code, printed, _, calls = self.run_script(self.home / "one", "--runs", "1")
        self.assertEqual(code, 1)
        self.assertEqual(len(calls), 3)
        self.assertIn("one, stillmap, profiled: exit code 1: no profile today", printed)
        self.assertEqual(self.row(printed, "tracking, median [ms]")[0], "1.00")

    def test_trajectories_that_differ_are_listed(self):
        (self.home / "drifting").touch()
        code, printed, _, _ = self.run_script(self.home / "one", "--runs", "1")
        self.assertEqual(code, 1)
        self.assertIn("trajectories differ", printed)

    def test_a_program_that_is_not_there_is_an_error(self):
        code, printed, _, _ = self.run_script(self.home / "one", programs=[self.home / "none"])
        self.assertEqual(code, 2)
        self.assertIn("there is no", printed)


class PaperDocs(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.root = Path(temporary.name)
        self.results, self.page = self.root / "results", self.root / "docs/papers.md"
        self.tables = self.root / "lab/records/papers_tables.md"
        (self.results / "papers").mkdir(parents=True)
        self.page.parent.mkdir()
        self.tables.parent.mkdir(parents=True)
        (self.results / "papers/summary.md").write_text(
            "Three runs.\n\n<!-- table: ate -->\n\n**ATE**\n\n| a |\n\n<!-- end of table -->\n")
        (self.results / "papers/seg-mask.md").write_text("# seg-mask\n\n| b |\n")
        self.page.write_text(
            "Before.\n\n<!-- table: papers/ate -->\nold\n<!-- end of table -->\n\nAfter.\n"
            "<!-- table: later/ate -->\nkept\n<!-- end of table -->\n")
        self.tables.write_text("<!-- file: papers/seg-mask.md -->\n<!-- end of file -->\n")

    def paste(self):
        return call_lab("paper_docs", self.results, "--root", self.root)

    def test_puts_the_tables_where_the_documents_name_them(self):
        self.assertEqual(self.paste().returncode, 0)
        self.assertEqual(self.page.read_text(),
                         "Before.\n\n<!-- table: papers/ate -->\n\n**ATE**\n\n| a |\n\n<!-- end of table -->\n\nAfter.\n"
                         "<!-- table: later/ate -->\nkept\n<!-- end of table -->\n")
        self.assertEqual(self.tables.read_text(),
                         "<!-- file: papers/seg-mask.md -->\n\n## seg-mask\n\n| b |\n\n<!-- end of file -->\n")
        self.assertEqual(self.paste().stdout, "", "nothing is left to change")

    def test_a_table_that_the_results_do_not_have_is_an_error(self):
        self.page.write_text("<!-- table: papers/rpe -->\n<!-- end of table -->\n")
        failed = self.paste()
        self.assertEqual(failed.returncode, 1)
        self.assertIn("has no table 'rpe'", failed.stderr)


class Zones(unittest.TestCase):
    """The comparison of warnings with the true ones."""

    def judged(self, *found, at=(0.5, 0.9, 3)):
        event = {"position": [0, 0, 3], "camera": [0, 0, 0, 0, 0, 0, 1], "timestamp": 10.0}
        truth = [("zone", "gate", 1, 10.0, 13.0, event), ("near", "camera", 1, 20.0, 22.0, event)]
        part = zones.judged(truth, [(*f, event) for f in found], {(10.0, 1): 900, (20.0, 1): 900}, self.positions(at))
        return zones.figures([part])

    def positions(self, at):
        """Two movers at 10 s, one of them at a position; up is -y."""
        with tempfile.TemporaryDirectory() as folder:
            rows = ["timestamp,id,x,y,z", "10.00000,1,5,5,5", "10.00000,2,{},{},{}".format(*at)]
            (Path(folder) / "movers.csv").write_text("\n".join(rows) + "\n")
            return zones.TruePositions(Path(folder), [0, -1, 0])

    def test_a_late_warning_is_found_with_its_latency(self):
        result = self.judged(("zone", "gate", 7, 10.2, 13.5))
        self.assertEqual((result["recall"], result["precision"]), (0.5, 1))
        self.assertAlmostEqual(result["latency_median_frames"], 6)
        self.assertEqual(result["found_by_distance"], {"2 to 4 m": [1, 2]})

    def test_another_rule_or_time_is_wrong(self):
        result = self.judged(("zone", "yard", 7, 10.2, 13.5), ("zone", "gate", 7, 30.0, 31.0))
        self.assertEqual((result["recall"], result["precision"]), (0, 0))

    def test_a_warning_without_a_mover_there_is_a_ghost(self):
        result = self.judged(("zone", "gate", 7, 10.2, 13.5), ("near", "yard", 8, 10.2, 13.5), at=(0.5, 0, 3.6))
        self.assertEqual((result["right"], result["ghosts"], result["warnings"]), (0, 2, 2))
        self.assertEqual(self.judged(("zone", "gate", 7, 10.2, 13.5))["ghosts"], 0)

    def test_a_course_announces_a_distance(self):
        result = self.judged(("course", "camera", 7, 19.0, 19.8), ("near", "camera", 7, 20.0, 22.0))
        self.assertEqual((result["found"], result["right"], result["latency_median_frames"]), (1, 2, 0))


class Surface(unittest.TestCase):
    """Measures of maps as surfaces."""

    @unittest.skipIf(surface.np, "nothing is missing")
    def test_a_missing_library_is_named_with_its_installation(self):
        done = call_lab("surface", "gone", "--out", "gone")
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, r"(numpy|open3d) is missing: python3 -m venv .* install open3d scikit-image")

    @unittest.skipUnless(surface.np, "skipped: open3d is missing")
    def test_poses_are_interpolated_but_not_over_gaps(self):
        poses = surface.np.array([[1.0, 0, 0, 0, 0, 0, 0, 1], [1.1, 2, 0, 0, 0, 0, 0.7071068, 0.7071068],
                                  [2.0, 4, 0, 0, 0, 0, 0, 1]])
        between = surface.pose_at(poses, 1.05)
        self.assertAlmostEqual(between[0, 3], 1)
        self.assertAlmostEqual(between[0, 0], 0.7071068, 5)  # 45 degrees
        self.assertEqual(surface.pose_at(poses, 2.0)[0, 3], 4)
        self.assertIsNone(surface.pose_at(poses, 1.5))
        self.assertIsNone(surface.pose_at(poses, 0.9))

    @unittest.skipUnless(surface.np, "skipped: open3d is missing")
    def test_a_plane_is_as_thick_as_its_points_scatter(self):
        np = surface.np
        random = np.random.default_rng(1)
        wall = np.stack([random.uniform(0, 2, 20000), random.uniform(0, 2, 20000), random.uniform(-0.01, 0.01, 20000)], 1)
        wall[:, 2] += 0.02 * wall[:, 0]  # a bend of the map is no thickness
        self.assertAlmostEqual(surface.thickness(wall, [np.array([0, 0, 1.0, 0])]), 18, delta=1)
        self.assertIsNone(surface.thickness(wall, [np.array([0, 0, 1.0, 5])]))

    @unittest.skipUnless(surface.np, "skipped: open3d is missing")
    def test_exposure_is_no_difference_of_images_but_blur_is(self):
        np = surface.np
        image = np.random.default_rng(1).uniform(0.2, 0.6, (40, 40, 3)).astype(np.float32)
        everywhere = np.ones((40, 40), bool)
        self.assertLess(surface.compared(1.3 * image, image, everywhere)[0], 1e-9)
        blurred = (image + np.roll(image, 1, 0) + np.roll(image, 1, 1)) / 3
        self.assertLess(surface.compared(blurred, image, everywhere)[1], 0.8)


if __name__ == "__main__":
    unittest.main()
