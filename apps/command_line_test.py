#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Command lines that must be refused with a fix, files that must not be overwritten, and the documented lists of files.

  apps/command_line_test.py PROGRAM     PROGRAM: the built command
"""
import contextlib
import fcntl
import json
import math
import os
import pty
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import termios
import time
import unittest
import zlib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PROGRAM = ""


def stillmap(*arguments, cwd=None):
    return subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False, cwd=cwd)


def finding(code, message):
    """Returns an entry of summary.json."""
    return {"code": code, "severity": "untrusted", "message": message, "fix": None, "evidence": {}}


def write_gray_png(file, rows):
    """Writes an image, given as the bytes of its rows."""
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    heading = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 0, 0, 0, 0)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows))
    file.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", heading) + chunk(b"IDAT", pixels) + chunk(b"IEND", b""))


class CommandLine(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.folder = Path(cls.temporary.name)
        cls.sequence = cls.folder / "sequence"
        made = stillmap("simulate", "--people", 1, "--frames", 20, "--width", 320, "--height", 240, "--out", cls.sequence)
        assert made.returncode == 0, made.stderr
        cls.run_folder = cls.folder / "run"
        cls.map = cls.folder / "office.map"
        done = stillmap("run", cls.sequence, "--mesh=ply,obj", "--planner", "--up", "0,-0.99,-0.15", "--camera-height", 1.35, "--save-labels", "--profile", "--out",
                        cls.run_folder, "--save-map", cls.map)
        assert done.returncode == 0, done.stderr
        cls.run_stderr = done.stderr

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def refused(self, result, code, *words):
        self.assertEqual(result.returncode, code, result.stdout + result.stderr)
        for word in words:
            self.assertIn(word, result.stderr)

    def succeeded(self, result):
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result

    def foreign(self, name, text="mine"):
        file = self.folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)
        return file

    # ------------------------------------------------------------------------------------------- unknown words

    def on_terminal(self, columns, *arguments):
        """The lines that the command writes to a terminal of this width."""
        own, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
        process = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=terminal, stderr=terminal)
        os.close(terminal)
        text = b""
        try:
            while part := os.read(own, 65536):
                text += part
        except OSError:  # the command has ended
            pass
        os.close(own)
        self.assertEqual(process.wait(), 0, text)
        return re.sub("\x1b\\[[0-9;]*[Km]", "", text.decode()).replace("\r", "\n").splitlines()

    def test_help_has_the_width_of_the_terminal(self):
        for columns in (60, 100):
            lines = self.on_terminal(columns, "run", "--help")
            options = lines[lines.index("Options:"):lines.index("Options:") + 60]
            too_long = [line for line in options if len(line) > columns and " " in line.strip()]
            self.assertEqual([line for line in too_long if "{" not in line], [])
            self.assertTrue(any(len(line) > 0.8 * columns for line in options))

    def test_messages_and_help_have_the_width_of_a_narrow_terminal(self):
        lines = self.on_terminal(20, "compare", "--help")
        self.assertEqual([line for line in lines if len(line) > 20 and " " in line.strip() and "stillmap " not in line], [])
        for columns in (40, 60):
            lines = self.on_terminal(columns, "doctor", self.sequence)
            self.assertEqual([line for line in lines if len(line) > columns and " " in line.strip()], [])

    def test_help_is_also_a_command(self):
        for words, same in ((["help"], ["--help"]), (["help", "run"], ["run", "--help"]), (["help", "map", "info"], ["map", "info", "--help"])):
            self.assertEqual(self.succeeded(stillmap(*words)).stdout, stillmap(*same).stdout)

    def test_slips_with_options_tell_what_is_expected(self):
        self.refused(stillmap("-v", "run", self.sequence), 2, "'-v' stands in front of the command", "stillmap COMMAND -v")
        for command, option in (("run", "--count"), ("simulate", "--frames")):
            self.refused(stillmap(command, option, "x"), 2, f"{option}: expects a whole number, not 'x'",
                         f"see stillmap {command} --help")
        self.refused(stillmap("eval", "a", "b", "--frames", "-3"), 2, "expects a whole number that is not negative, not '-3'")
        self.refused(stillmap("batch", "a", "--jobs", "0"), 2, "expects a whole number above zero, not '0'")

    def test_presets_are_wrapped_below_their_names(self):
        lines = self.on_terminal(60, "presets")
        self.assertEqual([line for line in lines if len(line) > 60], [])
        self.assertTrue(all(re.match("  [a-z]|                ", line) for line in lines if line), lines)

    def test_progress_stays_within_a_narrow_terminal(self):
        lines = self.on_terminal(20, "simulate", "--people", 0, "--frames", 30, "--width", 160, "--height", 120, "--out",
                                 self.folder / "narrow")
        progress = [line for line in lines if line.startswith("rendering")]
        self.assertTrue(progress)
        self.assertEqual([line for line in progress if len(line) >= 20], [])

    def test_help_names_the_types_of_values(self):
        for command in ("run", "view", "warn", "dense", "eval", "compare", "simulate", "demo", "calibrate", "doctor", "info",
                        "map info", "map slim", "map export", "presets", "options"):
            text = self.succeeded(stillmap(*command.split(), "--help")).stdout
            self.assertNotRegex(text, r"TEXT|UINT|NUMBER|NONNEGATIVE|Needs:|Excludes:", command)
        text = stillmap("run", "--help").stdout
        self.assertIn("--up X,Y,Z ", text)
        self.assertNotRegex(self.succeeded(stillmap("man")).stdout, "UINT|NUMBER|NONNEGATIVE")
        self.assertRegex(text, r"--localize-only[^(]*\(with\s+--load-map\) \(not with --save-map\)")
        for part in ("Recording:", "Method:", "Results:", "Saved maps:", "Terminal:", "--model FILE", "--masks DIR", "--first N"):
            self.assertIn(part, text)

    def test_colors_are_for_terminals_and_can_be_turned_off(self):
        self.assertNotIn("\x1b", stillmap("run", "--help").stdout)
        for value, kind, colored in (("", "xterm", True), ("1", "xterm", False), ("", "dumb", False)):
            own, terminal = pty.openpty()
            environment = dict(os.environ, NO_COLOR=value, TERM=kind)
            process = subprocess.Popen([PROGRAM, "compare", "--help"], stdout=terminal, env=environment)
            os.close(terminal)
            shown = b""
            with contextlib.suppress(OSError):  # of a terminal that has been closed
                while part := os.read(own, 65536):
                    shown += part
            process.wait()
            os.close(own)
            self.assertEqual(b"\x1b[1m" in shown, colored)

    def test_a_run_ends_with_the_file_to_open(self):
        out = self.folder / "talking"
        words = ("run", self.sequence, "--preset", "static", "--count", 5, "--out", out)
        done = self.succeeded(stillmap(*words))
        self.assertIn(f"Open {out}/report.html", done.stdout.splitlines()[-1])
        verbose = self.succeeded(stillmap(*words, "-v"))
        self.assertIn("features", verbose.stdout)
        self.assertNotIn("features", done.stdout)
        quiet = self.succeeded(stillmap(*words, "--quiet"))
        self.assertEqual(quiet.stdout + quiet.stderr, "")

    def test_progress_goes_on_to_the_end(self):
        for step in ("correcting the map and making its cloud", "writing the files"):
            self.assertIn(step, self.run_stderr)
        bars = {}
        for line in self.on_terminal(100, "doctor", self.sequence):
            if found := re.match(r"(pass \d+) \[([#.]+)\]", line):
                bars[found[1]] = found[2]
        self.assertTrue(bars)
        self.assertEqual([bar for bar in bars.values() if "." in bar], [])

    def test_quiet_commands_show_no_progress(self):
        words = ("simulate", "--people", 0, "--frames", 2, "--width", 160, "--height", 120, "--out")
        self.assertIn("rendering 2/2", stillmap(*words, self.folder / "told").stderr)
        self.assertEqual(self.succeeded(stillmap(*words, self.folder / "quiet", "-q")).stderr, "")

    def test_numbers_out_of_range_are_refused(self):
        for words, problem in ((("--planner", "--camera-height", "nan"), "--camera-height: nan is no height"),
                               (("--planner", "--camera-height", "1e9"), "give meters, up to 1000"),
                               (("--planner", "--up", "1e300,0,1"), "--up: '1e300,0,1' is no direction"),
                               (("--planner", "--up", "0,-1"), "such as --up 0,-1,0"),
                               (("--planner", "--up", "0 -1 0"), "give three numbers with commas"),
                               (("--set", "features.scale_factor=.nan"), "it must be from 1.05 to 2"),
                               (("--set", "dense.voxel=1e-9"), "it must be from 0.001 to 1")):
            self.refused(stillmap("run", self.sequence, *words, "--out", self.folder / "x"), 1, problem)
        self.refused(stillmap("run", self.sequence, "--first", "1e9"), 2, "--first", "fix: see stillmap run --help")

    def test_slips_are_no_defects(self):
        loop = self.folder / "loop"
        loop.symlink_to(loop)
        self.refused(stillmap("run", self.sequence, "--save-map", loop), 1, "symbolic links", "fix: check the path")
        spoiled = self.folder / "spoiled"
        shutil.copytree(self.run_folder, spoiled)
        (spoiled / "summary.json").write_text('{"frames": 3}')
        compared = stillmap("compare", "--truth", self.sequence / "groundtruth.txt", spoiled, "--out", self.folder / "spoiled_out")
        self.refused(compared, 1, "summary.json: has a value that is not as expected", "name the trajectory instead")

    def test_runs_are_compared_with_the_first(self):
        out = self.folder / "comparison"
        truth = self.sequence / "groundtruth.txt"
        done = self.succeeded(stillmap("compare", "--truth", truth, f"a={self.run_folder}", f"b={self.run_folder}", "--out", out))
        row = next(line for line in done.stdout.splitlines() if line.startswith("| b "))
        self.assertEqual(row.split("|")[3].strip(), "0.0")  # the same run is not better
        self.assertIn(f"Open {out}/comparison.html", done.stdout.splitlines()[-1])
        page = (out / "comparison.html").read_text()
        self.assertEqual([page.count(f'<img alt="{name}"') for name in "ab"], [1, 1], "the maps")
        names = {file.name for file in out.iterdir() if not file.name.startswith(".")}
        self.assertEqual(names, {f"comparison.{end}" for end in ("html", "md", "tex", "csv", "json", "svg")} | {"errors.svg"})

    def test_a_comparison_repeats_the_findings_of_its_runs(self):
        doubtful, out = self.folder / "doubtful", self.folder / "doubtful_comparison"
        shutil.copytree(self.run_folder, doubtful)
        summary = json.loads((doubtful / "summary.json").read_text())
        (doubtful / "summary.json").write_text(json.dumps({**summary, "findings": [finding("path-gap", "20 frames in a row have no pose")]}))
        done = stillmap("compare", "--truth", self.sequence / "groundtruth.txt", self.run_folder, doubtful, "--out", out)
        self.refused(done, 3, "DO NOT TRUST THIS RESULT: doubtful: 20 frames in a row have no pose")
        self.assertIn("| doubtful (untrusted) |", done.stdout)
        by_file = stillmap("compare", "--truth", self.sequence / "groundtruth.txt", self.run_folder, doubtful / "trajectory.txt", "--out", out)
        self.refused(by_file, 3, "DO NOT TRUST THIS RESULT: trajectory.txt: 20 frames in a row have no pose")
        for name in ("comparison.html", "comparison.md", "comparison.tex", "comparison.csv", "comparison.json"):
            self.assertIn("20 frames in a row have no pose", (out / name).read_text(), name)

    def test_a_trajectory_with_qw_first_is_doubted(self):
        poses = [(i / 30, math.cos(i / 60), math.sin(i / 60)) for i in range(90)]  # time, qw, and qz of a turning camera
        truth = self.foreign("turning.txt", "".join(f"{t} {t} 0 {t * t} 0 0 {z} {w}\n" for t, w, z in poses))
        swapped = self.foreign("swapped.txt", "".join(f"{t} {t} 0 {t * t} {w} 0 0 {z}\n" for t, w, z in poses))
        self.succeeded(stillmap("eval", truth, truth))
        done = stillmap("eval", truth, swapped, "--json", "-")
        self.refused(done, 3, "DO NOT TRUST THIS RESULT", f"if the quaternions of {swapped} are read as qw qx qy qz")
        self.assertEqual([f["code"] for f in json.loads(done.stdout)["findings"]], ["truth-reading"])
        framed = stillmap("eval", truth, truth, "--truth-frame", "bonn")
        self.refused(framed, 3, "without --truth-frame bonn")
        compared = stillmap("compare", "--truth", truth, truth, swapped, "--out", self.folder / "swapped")
        self.refused(compared, 3, "DO NOT TRUST THIS RESULT: swapped.txt: the motions")

    def test_a_truth_of_another_recording_is_doubted(self):
        paths = [[(i / 30, 0.3 * math.sin(k * i / 30), i / 90, math.sin(k * i / 60), math.cos(k * i / 60)) for i in range(120)] for k in (1, -2)]
        truth, other = (self.foreign(f"path{i}.txt", "".join(f"{t} {x} 0 {z} 0 {s} 0 {c}\n" for t, x, z, s, c in path))
                        for i, path in enumerate(paths))
        self.refused(stillmap("eval", truth, other), 3, "DO NOT TRUST THIS RESULT", "hardly anything in common")
        meters = "".join(f"{t} {1000 * x} 0 {1000 * z} 0 {s} 0 {c}\n" for t, x, z, s, c in paths[0])
        self.refused(stillmap("eval", truth, self.foreign("mm.txt", meters)), 3, "write both in meters")
        self.succeeded(stillmap("eval", truth, self.folder / "mm.txt", "--scale"))
        compared = stillmap("compare", "--truth", truth, truth, other, "--out", self.folder / "other_truth")
        self.refused(compared, 3, "path1.txt: the rotations")
        self.refused(stillmap("eval", self.sequence, truth), 1, "is a folder", "groundtruth.txt of a recording")

    def test_compared_runs_need_different_names(self):
        truth, out = self.sequence / "groundtruth.txt", self.folder / "same_names"
        self.refused(stillmap("compare", "--truth", truth, self.run_folder, self.run_folder, "--out", out), 1, "run: is the name of two runs", "NAME=PATH")
        self.refused(stillmap("compare", "--truth", truth, f"={self.run_folder}", "--out", out), 1, "has no name before '='")

    def test_a_missing_floor_says_nothing_about_the_trajectory(self):
        tilted = self.folder / "tilted"
        shutil.copytree(self.run_folder, tilted)
        summary = json.loads((tilted / "summary.json").read_text())
        (tilted / "summary.json").write_text(json.dumps({**summary, "findings": [finding("floor-unknown", "the floor is unknown")]}))
        self.succeeded(stillmap("compare", "--truth", self.sequence / "groundtruth.txt", self.run_folder, tilted, "--out", self.folder / "tilted_comparison"))

    def test_the_codes_of_findings_are_documented(self):
        table = self.succeeded(stillmap("findings")).stdout
        self.assertIn(table, (ROOT / "docs" / "findings.md").read_text())

    def test_version_names_the_libraries_of_networks(self):
        for flag in ("-V", "--version"):
            text = self.succeeded(stillmap(flag)).stdout
            self.assertRegex(text, r"^Stillmap \d+\.\d+\.\d+")
            self.assertRegex(text, r"networks run with: .*opencv")

    def test_an_unknown_command_or_option_names_the_nearest(self):
        self.refused(stillmap("simulat"), 2, "there is no command 'simulat'", "did you mean 'simulate'?")
        self.refused(stillmap("map", "inf", self.map), 2, "stillmap map: there is no command 'inf'", "'info'")
        for command in ("run", "view", "warn", "dense", "eval", "compare", "simulate", "demo", "doctor", "presets", "options"):
            self.refused(stillmap(command, "--hepl"), 2, f"stillmap {command}: there is no option '--hepl'",
                         "did you mean '--help'?")
        self.refused(stillmap("run", self.sequence, "--prest=static"), 2, "did you mean '--preset'?")
        self.refused(stillmap("sim"), 2, "did you mean 'simulate'?")
        self.refused(stillmap("run", self.sequence, "--mem", 3), 2, "did you mean '--memory'?")
        self.refused(stillmap("foo", "--help"), 2, "there is no command 'foo'")

    def test_an_unknown_preset_or_class_names_the_nearest(self):
        self.refused(stillmap("run", self.sequence, "--preset", "segmask"), 1, "preset 'segmask'", "'seg-mask'")
        unknown = stillmap("run", self.sequence, "--set", "motion.moving_classes=[persn]", "--out", self.folder / "x")
        self.refused(unknown, 1, "no class 'persn'", "did you mean 'person'?")
        self.assertFalse((self.folder / "x").exists())

    def test_a_recording_behind_mesh_is_not_taken_for_a_format(self):
        self.refused(stillmap("run", "--mesh", self.sequence), 1, "there is no mesh format", "--mesh=FORMAT")
        done = stillmap("run", "--mesh=obj", self.sequence, "--preset", "static", "--out", self.folder / "mesh_first")
        self.succeeded(done)
        self.assertTrue((self.folder / "mesh_first/mesh.obj").exists())

    # -------------------------------------------------------------------------------------------- foreign files

    def test_a_run_is_refused_before_it_computes(self):
        file = self.foreign("run_out/report.html")
        result = stillmap("run", self.sequence, "--out", file.parent)
        self.refused(result, 1, "report.html", "--force")
        self.assertNotIn("mapping", result.stderr)
        self.assertEqual(file.read_text(), "mine")

    def test_a_demo_is_refused_before_it_renders(self):
        for name in ("comparison.svg", "seg-mask/cloud.ply"):
            file = self.foreign(f"demo_{name[0]}/{name}")
            out = self.folder / f"demo_{name[0]}"
            result = stillmap("demo", "--frames", 10, "--out", out)
            self.refused(result, 1, name, "--force")
            self.assertFalse((out / "sequence").exists())
            self.assertEqual(file.read_text(), "mine")

    def test_a_comparison_is_refused_before_it_reads_the_runs(self):
        file = self.foreign("compared/comparison.md")
        truth = self.sequence / "groundtruth.txt"
        words = ["compare", "--truth", truth, self.run_folder, "--out", file.parent]
        self.refused(stillmap(*words), 1, "comparison.md", "--force")
        self.assertFalse((file.parent / "comparison.svg").exists())
        self.succeeded(stillmap(*words, "--force"))
        self.succeeded(stillmap(*words))

    def test_a_named_file_is_only_replaced_if_stillmap_wrote_it(self):
        truth, estimate = self.sequence / "groundtruth.txt", self.run_folder / "trajectory.txt"
        for words in (["eval", truth, estimate, "--json"], ["map", "info", self.map, "--json"], ["run", "--dump-config"],
                      ["map", "slim", self.map, "--out"]):
            file = self.foreign("named")
            self.refused(stillmap(*words, file), 1, "named", "--force")
            self.assertEqual(file.read_text(), "mine")
            self.succeeded(stillmap(*words, file, "--force"))
            self.assertNotEqual(file.read_bytes(), b"mine")
            self.succeeded(stillmap(*words, file))
        self.refused(stillmap("map", "slim", self.map, "--out", self.map), 1, "is the map itself")

    def test_a_dash_writes_to_standard_output_and_nothing_else(self):
        truth, estimate = self.sequence / "groundtruth.txt", self.run_folder / "trajectory.txt"
        self.assertIn("ate", json.loads(self.succeeded(stillmap("eval", truth, estimate, "--json", "-")).stdout))
        self.assertIn("keyframes", json.loads(self.succeeded(stillmap("map", "info", self.map, "--json", "-")).stdout))
        self.assertTrue(stillmap("run", "--dump-config", "-").stdout.startswith("# The options"))

    # ---------------------------------------------------------------------------------------------------- files

    def documented(self, text):
        return set(re.findall(r"[a-z_]+\.(?:txt|csv|jsonl?|png|ply|obj|mtl|glb|bt|pgm|yaml|map|html|svg|bin)\b", text))

    def test_help_and_documents_name_the_files_of_a_run(self):
        in_help = self.documented(stillmap("run", "--help").stdout.split("Files:")[1].split("docs/dense_map.md")[0])
        table = (ROOT / "docs/dense_map.md").read_text().split("## Files")[1].split("\n## ")[0]
        rows = "\n".join(line.split("|")[1] for line in table.splitlines() if line.startswith("| `"))
        self.assertEqual(self.documented(rows), in_help)
        written = {file.name for file in self.run_folder.iterdir() if not file.name.startswith(".")}
        self.assertLessEqual(written, in_help)
        self.assertLessEqual(in_help - written, {"changes.jsonl", "events.jsonl", "zones.yaml", "mesh.glb", "objects.json",
                                                 "semantic.ply", "semantic.png", "semantic_classes.ply", "semantic_legend.png",
                                                 "movers.png"})
        readme = (ROOT / "README.md").read_text()
        results = next(line for line in readme.splitlines() if line.startswith("| results |"))
        self.assertLessEqual(self.documented(results) - {"dense_map.md"}, in_help)

    def test_the_former_names_of_the_motion_labels_still_work(self):
        out = self.folder / "former"
        self.succeeded(stillmap("run", self.sequence, "--preset", "static", "--count", 10, "--save-verdicts",
                                "--draw-verdicts=5", "--out", out))
        self.assertTrue((out / "verdicts.bin").exists() and (out / "verdicts/000005.png").exists())
        figures = {}
        for option, file, key in (("--verdicts", out / "verdicts.bin", "verdicts"),
                                  ("--labels", self.run_folder / "labels.bin", "motion_labels")):
            shown = self.succeeded(stillmap("eval", option, file, "--sequence", self.sequence, "--json", "-"))
            figures[option] = json.loads(shown.stdout)[key]
        self.assertEqual(figures["--verdicts"].keys(), figures["--labels"].keys())
        self.assertNotIn("verdicts", stillmap("run", "--help").stdout + stillmap("eval", "--help").stdout)

    def test_a_camera_without_the_size_of_the_images_takes_that_of_the_images(self):
        values = dict(line.split(":")[:2] for line in (self.sequence / "camera.yaml").read_text().splitlines())
        fx, fy, cx, cy, factor = (values[key].split("#")[0].strip() for key in ("fx", "fy", "cx", "cy", "depth_factor"))
        camera = self.foreign("sizeless.yaml", f"camera_matrix: {{data: [{fx}, 0, {cx}, 0, {fy}, {cy}, 0, 0, 1]}}\n"
                                               f"depth_factor: {factor}\n")
        words = ["eval", self.sequence / "groundtruth.txt", self.run_folder / "trajectory.txt",
                 "--cloud", self.run_folder / "cloud.ply", "--sequence", self.sequence]
        own, given = (self.succeeded(stillmap(*words, *more)).stdout for more in ([], ["--camera", camera]))
        self.assertEqual(own, given)

    def test_figures_of_chosen_frames_and_of_the_maps_are_drawn(self):
        out = self.folder / "figures"
        done = self.succeeded(stillmap("run", self.sequence, "--preset", "seg-mask", "--masks", self.sequence / "mask", "--count",
                                       10, "--figures", "3,6,10", "--out", out))
        self.assertIn("there is no frame 10\n  fix: the last one is 9", done.stderr)
        drawn = sorted(file.name for file in (out / "figures").iterdir())
        frames = [f"{frame:06}_{kind}.png" for frame in (3, 6) for kind in ("depth", "flow", "keypoints", "objects")]
        self.assertEqual(drawn, frames + ["sparse_map.png"])
        gated = self.folder / "gated_figures"
        self.succeeded(stillmap("run", self.sequence, "--preset", "gated-seg", "--masks", self.sequence / "mask", "--figures", 3, "--out", gated))
        self.assertGreater(json.loads((gated / "summary.json").read_text())["refinement"]["repeated_erased"], 0)
        self.assertTrue((gated / "figures/repeated_landmarks.png").exists())
        self.refused(stillmap("run", self.sequence, "--figures=-1", "--out", self.folder / "none"), 1, "no frame -1")

    def test_the_shutters_are_estimated_from_all_frames_when_every_third_is_mapped(self):
        sequence, out = self.folder / "rolling", self.folder / "rolling_out"
        self.succeeded(stillmap("simulate", "--camera", "rpy", "--speed", 2, "--readout", 0.03, "--people", 0, "--frames", 90,
                                "--width", 320, "--height", 240, "--out", sequence))
        done = stillmap("run", sequence, "--stride", 3, "--set", "dense.enabled=false", "--out", out)
        self.succeeded(done)
        self.assertIn("shutters: readout", done.stdout)
        summary = json.loads((out / "summary.json").read_text())
        self.assertLess(summary["evaluation"]["ate"]["translation_m"]["rmse"], 0.01)  # 0.023 without the timing

    def test_the_former_names_of_simulated_objects_still_work(self):
        masks = []
        for words in (["--objects", 1, "--near-objects"], ["--things", 1, "--near-things"]):
            out = self.folder / f"simulated{words[0]}"
            self.succeeded(stillmap("simulate", "--people", 0, *words, "--frames", 2, "--width", 160, "--height", 120,
                                    "--out", out))
            masks.append((out / "truth_movers.csv").read_text())
        self.assertEqual(*masks)
        self.assertIn("unknown", masks[0])
        self.assertNotIn("things", stillmap("simulate", "--help").stdout)

    # ---------------------------------------------------------------------------------------------------- notes

    def test_a_truth_of_the_bonn_data_set_is_that_of_its_marker(self):
        bonn = self.folder / "rgbd_bonn_crowd"
        bonn.mkdir()
        truth = shutil.copy(self.sequence / "groundtruth.txt", bonn)
        words = ["eval", truth, self.run_folder / "trajectory.txt"]
        default, marker, camera = (self.succeeded(stillmap(*words, *frame)).stdout for frame in
                                   ([], ["--truth-frame", "bonn"], ["--truth-frame", "camera"]))
        self.assertEqual(default, marker)
        self.assertNotEqual(default, camera)
        plain = stillmap("eval", self.sequence / "groundtruth.txt", self.run_folder / "trajectory.txt")
        self.assertEqual(self.succeeded(plain).stdout, camera)

    def test_what_says_nothing_about_the_result_is_a_note(self):
        poses = (self.sequence / "groundtruth.txt").read_text().splitlines()
        rounded = [f"{float(line.split()[0]):.1f} {line.split(maxsplit=1)[1]}" for line in poses if not line.startswith("#")]
        truth = self.foreign("rounded.txt", "\n".join(rounded) + "\n")
        out = self.folder / "noted"
        done = stillmap("run", self.sequence, "--preset", "static", "--set", "network.every=2", "--truth", truth, "--out", out)
        self.assertIn("note: --set network.every=2 has no effect", self.succeeded(done).stderr)
        self.assertIn("as if the times had been rounded", done.stderr)
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual([(f["code"], f["severity"]) for f in summary["findings"]], [("unused-setting", "note"), ("truth-times", "note")])

    def test_the_sensor_is_named(self):
        self.assertRegex(stillmap("map", "info", self.map).stdout, r"sensor +kinect_v1")
        exact = self.folder / "exact"
        self.succeeded(stillmap("simulate", "--no-noise", "--people", 0, "--frames", 2, "--width", 160, "--height", 120,
                                "--out", exact))
        self.assertIn("sensor: ideal", (exact / "camera.yaml").read_text())
        self.refused(stillmap("simulate", "--no-noise", "--sensor", "kinect_v1"), 2, "--no-noise")

    def test_doctor_checks_the_named_associations(self):
        lines = (self.sequence / "associations.txt").read_text().splitlines()
        few = self.foreign("few.txt", "\n".join(lines[:5]) + "\n")
        shown = stillmap("doctor", self.sequence, "--associations", few).stdout
        self.assertIn("5 pairs of color and depth", shown)

    # ------------------------------------------------------------------------------------------- nothing is lost

    def test_a_run_survives_outputs_that_cannot_be_written(self):
        with open("/dev/full", "w") as full:
            for name, streams in {"errors": {"stderr": full}, "output": {"stdout": full}}.items():
                out = self.folder / f"full_{name}"
                done = subprocess.run([PROGRAM, "run", self.sequence, "--out", out], check=False,
                                      **{"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, **streams})
                self.assertTrue((out / "report.html").exists(), name)
                self.assertEqual(done.returncode, 1 if name == "output" else 0, name)

    def test_a_run_goes_on_when_the_reader_of_its_output_ends(self):
        out = self.folder / "closed"
        done = subprocess.run(f"{PROGRAM} run {self.sequence} --out {out} 2>&1 | head -1", shell=True, check=False,
                              stdout=subprocess.DEVNULL)
        self.assertEqual(done.returncode, 0)
        for _ in range(200):  # the run is not waited for by the shell
            if (out / "report.html").exists():
                break
            time.sleep(0.1)
        self.assertTrue((out / "report.html").exists())

    def test_a_closed_terminal_saves_the_results_so_far(self):
        sequence, out = self.folder / "long", self.folder / "hangup"
        self.succeeded(stillmap("simulate", "--people", 0, "--frames", 150, "--width", 160, "--height", 120, "--out", sequence))
        with subprocess.Popen([PROGRAM, "run", sequence, "--schedule", "realtime", "--out", out],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            status = Path(f"/proc/{process.pid}/status")
            while not int(re.search(r"SigCgt:\s*(\w+)", status.read_text())[1], 16) & 1:  # SIGHUP is number 1
                time.sleep(0.05)
            process.send_signal(signal.SIGHUP)
            self.assertEqual(process.wait(), 130)
        summary = json.loads((out / "summary.json").read_text())
        self.assertTrue(summary["interrupted"])
        self.assertLess(summary["frames"]["handed_in"], 150)

    def test_record_keeps_the_frames_so_that_their_trajectory_is_the_same(self):
        kept, before, after = (self.folder / name for name in ("kept", "run_before", "run_after"))
        printed = self.succeeded(stillmap("record", self.sequence, kept)).stdout
        self.assertIn("20 frames, 0 skipped", printed)
        self.assertIn("depth registered to color from 0.45 to 7.5 m in steps of 0.2 mm; not kept: images as the camera took them", printed)
        self.refused(stillmap("record", self.sequence, kept), 1, "is not empty", "new folder")
        for sequence, out in ((self.sequence, before), (kept, after)):
            self.succeeded(stillmap("run", sequence, "--preset", "static", "--set", "dense.enabled=false", "--out", out))
        self.assertEqual((before / "trajectory.txt").read_bytes(), (after / "trajectory.txt").read_bytes())

    def test_record_keeps_the_samples_of_the_imu(self):
        sequence, kept = self.folder / "with_imu", self.folder / "kept_imu"
        self.succeeded(stillmap("simulate", "--people", 0, "--frames", 10, "--width", 320, "--height", 240, "--imu", "d435i", "--out", sequence))
        self.succeeded(stillmap("record", sequence, kept))

        def samples(file):
            return [line for line in file.read_text().splitlines() if not line.startswith("#")]
        recorded, original = samples(kept / "imu.csv"), samples(sequence / "imu0" / "data.csv")
        self.assertGreater(len(recorded), 60)
        self.assertIn(recorded[0], original)
        self.assertIn("imu: d435i", (kept / "camera.yaml").read_text())

    def test_ignored_pixels_stay_ignored_in_a_recorded_folder(self):
        ignore, kept, before, after = (self.folder / name for name in ("gripper.png", "kept_ignore", "ignore_before", "ignore_after"))
        self.refused(stillmap("run", self.sequence, "--ignore", ignore), 1, "gripper.png", "is missing", "white where the images show the robot")
        write_gray_png(ignore, [bytes(320)] * 160 + [b"\xff" * 320] * 80)
        self.assertIn("ignored: 33.3 % of the image", self.succeeded(stillmap("record", self.sequence, kept, "--ignore", ignore)).stdout)
        self.assertIn('ignore: "ignore.png"', (kept / "camera.yaml").read_text())
        for sequence, options, out in ((self.sequence, ("--ignore", ignore), before), (kept, (), after)):
            printed = self.succeeded(stillmap("run", sequence, *options, "--preset", "static", "--set", "dense.enabled=false", "--out", out)).stdout
            self.assertIn("ignored: 33.3 % of the image", printed)
        self.assertEqual((before / "trajectory.txt").read_bytes(), (after / "trajectory.txt").read_bytes())

    def test_a_depth_factor_that_is_wrong_by_ten_makes_a_result_doubtful(self):
        sequence, wrong = self.folder / "azure", self.folder / "wrong.yaml"
        self.succeeded(stillmap("simulate", "--people", "0", "--frames", "10", "--width", "320", "--height", "240", "--sensor",
                                "azure_kinect", "--out", sequence))
        camera = (sequence / "camera.yaml").read_text()
        for factor, code in ((1, 0), (10, 3), (0.1, 3)):
            wrong.write_text(re.sub(r"depth_factor: (\d+)", lambda match: f"depth_factor: {float(match[1]) * factor}", camera))
            result = stillmap("run", sequence, "--camera", wrong, "--preset", "static", "--set", "dense.enabled=false", "--out",
                              self.folder / f"factor_{factor}")
            self.assertEqual(result.returncode, code, result.stderr)
            told = result.stdout + result.stderr
            self.assertEqual("the median of the depth readings is" in told or "no frame has a depth" in told, code == 3, told)

    def test_a_growing_folder_is_followed_until_the_user_ends_it(self):
        growing, out = self.folder / "growing", self.folder / "followed"
        for name in ("rgb", "depth"):
            shutil.copytree(self.sequence / name, growing / name)
        shutil.copy(self.sequence / "camera.yaml", growing)
        lists = {name: (self.sequence / name).read_text().splitlines(keepends=True) for name in ("rgb.txt", "depth.txt")}
        for name, lines in lists.items():
            (growing / name).write_text("".join(lines[:8]))
        live = out / "trajectory_live.txt"
        with subprocess.Popen([PROGRAM, "run", growing, "--out", out, "--follow", "1000"],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            while not (live.exists() and live.read_text().count("\n") >= 5) and process.poll() is None:
                time.sleep(0.02)
            for name, lines in lists.items():
                (growing / name).write_text("".join(lines))
            while live.read_text().count("\n") < 18 and process.poll() is None:
                time.sleep(0.02)
            process.send_signal(signal.SIGINT)
            self.assertEqual(process.wait(), 130)
        self.assertGreaterEqual(json.loads((out / "summary.json").read_text())["frames"]["handed_in"], 15)
        self.refused(stillmap("run", growing, "--follow=-1"), 1, "the time to wait for images is -1", "give seconds")
        self.refused(stillmap("run", growing, "--fps=0"), 1, "the frame rate is 0")

    def test_a_killed_run_leaves_its_poses_and_the_files_of_the_run_before(self):
        sequence, out = self.folder / "killed_sequence", self.folder / "killed"
        self.succeeded(stillmap("simulate", "--people", 0, "--frames", 150, "--width", 160, "--height", 120, "--out", sequence))
        self.succeeded(stillmap("run", sequence, "--count", 10, "--out", out))
        during = {"trajectory_live.txt", "run.journal", ".stillmap-manifest.json"}
        before = {file.name: file.read_bytes() for file in out.iterdir() if file.name not in during}
        with subprocess.Popen([PROGRAM, "run", sequence, "--schedule", "realtime", "--out", out],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
            live = out / "trajectory_live.txt"
            while live.read_text().count("\n") < 20 and process.poll() is None:
                time.sleep(0.02)
            process.kill()
        lines = [line.split() for line in live.read_text().splitlines() if not line.startswith("#")]
        self.assertGreaterEqual(len(lines), 15)
        self.assertTrue(all(len(line) == 8 for line in lines), "every line is whole")
        after = {file.name: file.read_bytes() for file in out.iterdir() if file.name not in during}
        self.assertTrue(after == before, "the files of the run before are as they were")
        self.succeeded(stillmap("run", sequence, "--count", 10, "--out", out, "--force"))

    def test_nohup_lets_a_run_go_on_when_its_terminal_is_closed(self):
        sequence, out = self.folder / "nohup_sequence", self.folder / "nohup"
        self.succeeded(stillmap("simulate", "--people", 0, "--frames", 40, "--width", 160, "--height", 120, "--out", sequence))
        ignored = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does; inherited by the run
        try:
            with subprocess.Popen([PROGRAM, "run", sequence, "--schedule", "realtime", "--out", out],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
                while not (out / "trajectory_live.txt").exists() and process.poll() is None:
                    time.sleep(0.02)
                process.send_signal(signal.SIGHUP)
                self.assertEqual(process.wait(), 0)
        finally:
            signal.signal(signal.SIGHUP, ignored)
        self.assertFalse(json.loads((out / "summary.json").read_text())["interrupted"])

    def test_two_runs_do_not_share_a_folder(self):
        out = self.folder / "shared"
        out.mkdir()
        descriptor = os.open(out, os.O_RDONLY)
        fcntl.flock(descriptor, fcntl.LOCK_EX)
        self.refused(stillmap("run", self.sequence, "--out", out), 1, "another run writes", "--out")
        (out / "run.journal").write_bytes(b"")
        for command in ("dense", "view"):
            self.refused(stillmap(command, out), 1, "another run writes its results to this folder", "wait for its end")
        os.close(descriptor)
        self.refused(stillmap("dense", out), 1, "stillmap recover")
        (out / "run.journal").unlink()
        self.succeeded(stillmap("run", self.sequence, "--out", out))

    def test_an_interrupted_simulation_is_a_whole_sequence(self):
        out = self.folder / "interrupted_sequence"
        with subprocess.Popen([PROGRAM, "simulate", "--people", "0", "--frames", "500", "--width", "160", "--height", "120", "--out", out],
                              stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True) as process:
            while len(list((out / "rgb").glob("*.png"))) < 5 and process.poll() is None:
                time.sleep(0.02)
            process.send_signal(signal.SIGTERM)
            text = process.stdout.read()
            self.assertEqual(process.wait(), 130)
        self.assertIn("of 500 frames", text)
        frames = len((out / "rgb.txt").read_text().splitlines()) - 2
        self.assertEqual(frames, len(list((out / "depth").glob("*.png"))))
        self.assertEqual(frames, len((out / "groundtruth.txt").read_text().splitlines()) - 1)
        self.succeeded(stillmap("info", out))

    def test_names_that_are_no_utf8_cost_no_file(self):
        folder = os.fsencode(self.folder) + b"/B\xfcro"
        shutil.copytree(os.fsencode(self.sequence), folder)
        out = self.folder / "latin"
        done = subprocess.run([PROGRAM, "run", folder, "--out", out], capture_output=True, check=False)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("B\ufffdro", json.loads((out / "summary.json").read_text())["sequence"])
        self.assertTrue((out / "report.html").exists())

    def test_a_pipe_is_refused_where_a_file_is_expected(self):
        pipe = self.folder / "pipe"
        os.mkfifo(pipe)
        truth = self.sequence / "groundtruth.txt"
        for arguments in (["map", "info", pipe], ["run", self.sequence, "--camera", pipe], ["eval", truth, pipe],
                          ["run", self.sequence, "--config", pipe], ["map", "info", "/dev/zero"]):
            self.refused(stillmap(*arguments), 1, "is a pipe or device")

    def test_positions_that_are_no_positions_are_refused(self):
        far = self.folder / "far.txt"
        far.write_text("0 1e300 0 0 0 0 0 1\n")
        self.refused(stillmap("eval", self.sequence / "groundtruth.txt", far), 1, "far.txt:1", "is too large")

    def test_tables_of_movers_are_checked(self):
        movers = (self.sequence / "truth_movers.csv").read_text()
        header = next(line for line in movers.splitlines() if not line.startswith("#"))
        truth = self.sequence / "groundtruth.txt"

        def evaluated(name, text):
            file = self.folder / name
            file.write_text(text)
            return stillmap("eval", truth, truth, "--movers", file, self.sequence / "truth_movers.csv")

        self.succeeded(evaluated("same.csv", movers))
        self.refused(evaluated("twice.csv", movers.replace(header, header + ",x")), 1, "two columns have the name 'x'")
        moved = re.sub(r"(?m)^(\d+),([\d.]+)", lambda m: f"{m[1]},{float(m[2]) + 900}", movers)
        self.refused(evaluated("moved.csv", moved), 1, "no timestamp in common")

    def test_the_map_of_a_straight_path_is_aligned_by_whole_poses(self):
        yard = self.folder / "yard"
        self.succeeded(stillmap("simulate", "--scene", "yard", "--camera", "trolley", "--people", 0, "--frames", 30, "--width", 160,
                                "--height", 120, "--out", yard))
        lines = [line for line in (yard / "groundtruth.txt").read_text().splitlines() if not line.startswith("#")]
        estimate = []
        for i, line in enumerate(lines):  # errors of 5 mm, so that positions do not determine the roll about the path
            stamp, *numbers = line.split()
            numbers[:3] = [f"{float(number) + 0.005 * math.sin(12.9 * i + axis)}" for axis, number in enumerate(numbers[:3])]
            estimate.append(" ".join([stamp, *numbers]))
        words = [self.foreign("straight.txt", "\n".join(estimate)), "--cloud", yard / "surface.ply", "--sequence", yard]
        shown = self.succeeded(stillmap("eval", yard / "groundtruth.txt", *words, "--json", "-"))
        self.assertIn("aligned by whole poses", shown.stderr)
        figures = json.loads(shown.stdout)
        self.assertEqual(figures["alignment_of_maps"]["by"], "poses")
        self.assertLess(figures["surface"]["stray_share"], 0.01)

    # ------------------------------------------------------------------------------------------- doubtful results

    def doubtful(self, result, *words):
        self.refused(result, 3, "DO NOT TRUST THIS RESULT", *words)

    def test_a_run_that_loses_most_frames_is_doubtful(self):
        wrong = self.folder / "wrong_depth.yaml"
        camera = (self.sequence / "camera.yaml").read_text()
        self.assertIn("depth_factor", camera)
        wrong.write_text(re.sub("depth_factor:.*", "depth_factor: 500", camera))
        out = self.folder / "doubtful"
        self.doubtful(stillmap("run", self.sequence, "--camera", wrong, "--out", out), "of 20 frames have a pose", "doctor")
        summary = json.loads((out / "summary.json").read_text())
        self.assertEqual([f["code"] for f in summary["findings"]], ["no-depth", "low-coverage"])
        self.assertTrue(all(f["severity"] == "untrusted" and f["fix"] for f in summary["findings"]))
        self.assertIn("Do not trust this result", (out / "report.html").read_text())

    def test_masks_of_another_recording_are_doubtful(self):
        masks = self.folder / "other_masks"
        masks.mkdir()
        for file in (self.sequence / "mask").iterdir():
            shutil.copy(file, masks / f"{float(file.stem) + 5000:.6f}.png")
        self.doubtful(stillmap("run", self.sequence, "--masks", masks, "--out", self.folder / "masked"), "no usable mask")

    def test_the_floor_is_told_or_unknown(self):
        sequence, out = self.folder / "sharp", self.folder / "floor"
        self.succeeded(stillmap("simulate", "--people", 0, "--frames", 10, "--out", sequence))
        self.succeeded(stillmap("run", sequence, "--planner", "--out", out))
        floor = json.loads((out / "floor.json").read_text())
        self.assertEqual(floor["frame"], "map", floor)
        truth = (sequence / "groundtruth.txt").read_text().splitlines()[1].split()
        self.assertAlmostEqual(floor["evidence"]["camera_height_m"], float(truth[3]), delta=0.03)
        height, x, y, z, w = map(float, (self.sequence / "groundtruth.txt").read_text().splitlines()[1].split()[3:])
        up = [round(c, 3) for c in (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))]
        level = ("--up", ",".join(map(str, up)), "--camera-height", str(height))
        given = stillmap("dense", self.run_folder, "--planner", *level, "--out", out)
        self.succeeded(given)
        floor = json.loads((out / "floor.json").read_text())
        self.assertAlmostEqual(floor["floor"]["height"], -height, delta=1e-6)
        for given_axis, axis in zip(up, floor["floor"]["up"], strict=True):
            self.assertAlmostEqual(axis, given_axis, delta=0.001)
        again = self.folder / "floor_again"
        self.succeeded(stillmap("dense", self.run_folder, "--planner", "--floor", out / "floor.json", "--out", again))
        self.assertEqual((again / "grid.pgm").read_bytes(), (out / "grid.pgm").read_bytes())
        # In the direction of the optical axis there is only the wall behind the camera, which was not seen.
        unknown = stillmap("dense", self.run_folder, "--planner", "--up", "0,0,1", "--out", out)
        self.doubtful(unknown, "the floor is unknown", "--camera-height")
        self.assertEqual(json.loads((out / "floor.json").read_text())["frame"], "first camera")
        self.refused(stillmap("dense", self.run_folder, "--planner", "--floor", self.map, "--out", out), 1, "contains no floor")
        self.refused(stillmap("dense", self.run_folder, "--planner", "--up", "0,0,0", "--out", out), 1, "is no direction")
        self.refused(stillmap("dense", self.run_folder, "--camera-height", 1, "--out", out), 2, "--planner")
        self.refused(stillmap("dense", self.run_folder, "--planner", "--floor", again / "floor.json", "--up", "0,-1,0"), 2, "excludes")

    def test_the_octomap_is_written_without_messages_of_its_library(self):
        self.assertNotIn("nodes", self.run_stderr)


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv.pop()).resolve())
    unittest.main()
