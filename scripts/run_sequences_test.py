#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of run_sequences.py with a fake mapping program."""
import json
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SCRIPT = Path(__file__).resolve().parent / "run_sequences.py"

# Writes its command lines to calls.txt beside it, and results as `stillmap` does. ATE: 0.01 for static, 0.005 for
# fused, 0.02 without its history; fails with preset seg-mask as long as there is a file `broken` beside it.
PROGRAM = r"""#!{python}
import json, sys
from pathlib import Path
home, words = Path(__file__).parent, sys.argv[1:]
with (home / "calls.txt").open("a") as calls:
    calls.write(" ".join(words) + "\n")
after = lambda word: words[words.index(word) + 1] if word in words else ""
if words[0] == "eval":
    if "--measure-speeds" in words:
        Path(after("--measure-speeds")).mkdir(parents=True)
    else:
        figures = {{"verdicts": {{"precision": {{"mean": 0.9}}, "recall": {{"mean": 0.8}}}}}}
        Path(after("--json")).write_text(json.dumps(figures))
    sys.exit(0)
preset, out = after("--preset"), Path(after("--out"))
if preset == "seg-mask" and (home / "broken").exists():
    print("the network is no network")
    sys.exit(3)
ate = {{"static": 0.01, "fused": 0.005}}.get(preset, 0.03)
if after("--set") == "motion.without=history":
    ate = 0.02
cues = ["residual", "history"] if preset == "fused" else []
out.mkdir(parents=True, exist_ok=True)
(out / "verdicts.bin").write_text("")
(out / "summary.json").write_text(json.dumps({{
    "evaluation": {{"ate": {{"translation_m": {{"rmse": ate, "sd": 0.001}}}},
                    "rpe_1s": {{"translation_m": {{"rmse": 0.011}}, "rotation_deg": {{"rmse": 0.4}}}}}},
    "frames": {{"tracked": 9, "total": 10}}, "tracking_median_ms": 7.5, "frames_per_second": 30,
    "peak_memory_mib": 100, "maps": 1, "landmarks": 500,
    "timing_ms": [{{"name": "motion: " + cue, "median_ms": 0.5}} for cue in cues]}}))
"""


class RunSequences(unittest.TestCase):
    def setUp(self):
        self.holder = tempfile.TemporaryDirectory()
        self.addCleanup(self.holder.cleanup)
        self.home = Path(self.holder.name)
        for name in ("one", "two"):
            (self.home / "sequences" / name / "mask").mkdir(parents=True)
            (self.home / "sequences" / name / "groundtruth.txt").touch()
        self.program = self.home / "program"
        self.program.write_text(PROGRAM.format(python=sys.executable))
        self.program.chmod(0o755)

    def run_script(self, *words):
        """@return exit code, what was printed, the rows of table.json, and the calls that this run made"""
        calls = self.home / "calls.txt"
        calls.write_text("")
        done = subprocess.run([sys.executable, SCRIPT, self.home / "sequences", "--out", self.home / "out",
                               "--model", "net.onnx", "--program", self.program, *words],
                              capture_output=True, text=True, check=False)
        rows = json.loads((self.home / "out/table.json").read_text())["runs"]
        return done.returncode, done.stdout, rows, calls.read_text().splitlines()

    def test_every_sequence_is_run_with_every_preset_and_judged(self):
        code, printed, rows, calls = self.run_script("--presets", "static,fused,fused-nonet")
        self.assertEqual(code, 0)
        self.assertEqual([(r["sequence"], r["preset"]) for r in rows],
                         [(s, p) for s in ("one", "two") for p in ("static", "fused", "fused-nonet")])
        self.assertEqual(rows[1]["ate_rmse_m"], 0.005)
        self.assertEqual((rows[1]["rpe_1s_m"], rows[1]["rpe_1s_deg"]), (0.011, 0.4))
        self.assertEqual((rows[1]["tracked"], rows[1]["frames"], rows[1]["tracking_median_ms"]), (9, 10, 7.5))
        self.assertEqual((rows[1]["precision"], rows[1]["recall"]), (0.9, 0.8))
        runs = [call for call in calls if call.startswith("run")]
        self.assertEqual(["--model net.onnx" in call for call in runs], [False, True, False] * 2)
        self.assertEqual(sum("--measure-speeds" in call for call in calls), 2)  # once a sequence
        self.assertIn("| one | 0.0100 (9/10) | **0.0050** (9/10) |", printed)
        self.assertEqual((self.home / "out/table.md").read_text() + "\n", printed)

    def test_what_is_there_is_not_run_again(self):
        self.run_script("--presets", "static")
        _, _, rows, calls = self.run_script("--presets", "static,fused")
        self.assertEqual([c.split()[3] for c in calls if c.startswith("run")], ["fused", "fused"])
        self.assertEqual(len(rows), 4)
        (self.home / "out/one_static/run.json").unlink()  # what an interrupted run leaves
        self.assertEqual(sum(c.startswith("run") for c in self.run_script("--presets", "static")[3]), 1)
        self.assertEqual(sum(c.startswith("run") for c in self.run_script("--presets", "static", "--again")[3]), 2)
        self.assertEqual(self.run_script("--presets", "static,fused", "--table")[3], [])
        self.program.write_text(self.program.read_text() + "# another program\n")
        self.assertEqual(sum(c.startswith("run") for c in self.run_script("--presets", "static")[3]), 2)

    def test_a_failure_is_told_and_tried_again_and_stops_nobody(self):
        (self.home / "broken").touch()
        code, printed, rows, _ = self.run_script("--presets", "seg-mask,fused")
        self.assertEqual(code, 1)
        self.assertEqual([r["error"] is not None for r in rows], [True, False] * 2)
        self.assertIn("- one, seg-mask: exit code 3: the network is no network", printed)
        self.assertEqual(self.run_script("--presets", "seg-mask,fused", "--table")[2], rows)
        (self.home / "broken").unlink()
        code, printed, rows, calls = self.run_script("--presets", "seg-mask,fused")
        self.assertEqual((code, [r["error"] for r in rows]), (0, [None] * 4))
        self.assertEqual([c.split()[3] for c in calls if c.startswith("run")], ["seg-mask", "seg-mask"])
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

    def test_figures_of_others_stand_beside(self):
        (self.home / "others.json").write_text('{"one": {"Peer": 0.0123}}')
        printed = self.run_script("--presets", "static", "--beside", str(self.home / "others.json"))[1]
        self.assertIn("| sequence | static | Peer |", printed)
        self.assertIn("| one | **0.0100** (9/10) | 0.0123 |", printed)
        self.assertIn("| two | **0.0100** (9/10) | - |", printed)


if __name__ == "__main__":
    unittest.main()
