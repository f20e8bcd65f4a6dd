#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs into a fresh folder, hides source and build folders, and uses the installed files.

The folders are hidden by mounts in a mount namespace of this test, if the system permits that (as root). Without
that right the test still checks that no installed program names them.

  install_test.py --source DIR --build DIR ...      (the arguments are given by cmake/Install.cmake)
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import toy_network

ARGUMENTS = None  # of the command line
FOLDER = None     # of all that the test writes


def parse(words):
    parser = argparse.ArgumentParser()
    for name in ("source", "build", "cmake", "build-type", "version", "libdir", "openvino", "headers"):
        parser.add_argument("--" + name, required=True)
    parser.add_argument("--hidden-in", default="", help="set by the test itself: its folder, sources are hidden")
    return parser.parse_args(words)


def hidden_folders(arguments):
    """The folders that an installed program must not need."""
    source = Path(arguments.source)
    folders = [source, Path(arguments.build), source / "build" / "venv"]
    return sorted({str(folder.resolve()) for folder in folders if folder.exists()})


def run(*command, **more):
    environment = os.environ | {"STILLMAP_ONNXRUNTIME": "/nowhere"}  # there may be one on this computer
    result = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, cwd="/",
                            env=environment, **more)
    result.text = result.stdout + result.stderr
    return result


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.prefix = FOLDER / "prefix"
        cls.library = cls.prefix / ARGUMENTS.libdir
        cls.program = cls.prefix / "bin" / "stillmap"
        cls.network = FOLDER / "toy.onnx"
        toy_network.write(cls.network)
        cls.sequence = FOLDER / "sequence"
        made = run(cls.program, "simulate", "--people", 1, "--frames", 4, "--width", 160, "--height", 120,
                   "--out", cls.sequence)
        assert made.returncode == 0, made.text

    def map_with_network(self, program, *more):
        """Runs the command with the toy network; returns the result and the back end that summary.json names."""
        out = FOLDER / "results"
        shutil.rmtree(out, ignore_errors=True)
        result = run(program, "run", self.sequence, "--model", self.network, "--out", out, *more)
        summary = out / "summary.json"
        detector = json.loads(summary.read_text())["detector"] if summary.exists() else ""
        return result, detector

    def moved_prefix(self, name):
        """Copies the installed files to another folder and returns it."""
        copy = FOLDER / name
        shutil.copytree(self.prefix, copy, symlinks=True)
        self.addCleanup(shutil.rmtree, copy)
        return copy

    def programs(self):
        return [self.program, *sorted((self.library / "stillmap").glob("libstillmap_*.so"))]

    def test_all_files_are_there(self):
        for name in ("bin/stillmap", "share/man/man1/stillmap.1.gz", "share/bash-completion/completions/stillmap",
                     "share/zsh/site-functions/_stillmap",
                     "share/doc/stillmap/LICENSE", "share/stillmap/presets/fused.yaml",
                     f"{ARGUMENTS.libdir}/cmake/Stillmap/StillmapConfig.cmake"):
            self.assertTrue((self.prefix / name).is_file(), name)
        self.assertEqual([file.name for file in self.library.glob("lib*")], ["libstillmap.a"])

    def test_public_headers_and_no_others_are_installed(self):
        include = self.prefix / "include" / "stillmap"
        found = sorted(file.relative_to(include).as_posix() for file in include.rglob("*") if file.is_file())
        self.assertEqual(found, sorted(ARGUMENTS.headers.split(";")))
        self.assertLessEqual(len(found), 18)

    def test_no_program_names_the_source_or_build_folder(self):
        for program in self.programs():
            with self.subTest(program=program.name):
                dynamic = run("readelf", "-d", program)
                self.assertEqual(dynamic.returncode, 0, dynamic.text)
                for paths in re.findall(r"\((?:RUNPATH|RPATH)\).*\[(.*)\]", dynamic.stdout):
                    for path in paths.split(":"):
                        self.assertTrue(path.startswith("$ORIGIN"), paths)
                if ARGUMENTS.build_type == "Debug":
                    continue  # its debug information names the sources
                content = program.read_bytes()
                for folder in hidden_folders(ARGUMENTS):
                    self.assertNotIn(folder.encode(), content)

    def test_all_libraries_are_found(self):
        for program in self.programs():
            self.assertNotIn("not found", run("ldd", program).text, program)

    def test_the_command_tells_its_version(self):
        self.assertIn(f"Stillmap {ARGUMENTS.version} ", run(self.program, "--version").stdout.replace("\n", " "))

    def test_the_command_maps_with_the_fastest_back_end(self):
        result, detector = self.map_with_network(self.program)
        self.assertEqual(result.returncode, 0, result.text)
        openvino = ARGUMENTS.openvino == "1"
        self.assertIn("OpenVINO" if openvino else "OpenCV", detector)
        self.assertEqual("warning" in result.stderr, not openvino, result.stderr)

    def test_without_the_plug_in_opencv_takes_over_and_the_warning_says_so_once(self):
        prefix = self.moved_prefix("without_plugin")
        shutil.rmtree(prefix / ARGUMENTS.libdir / "stillmap", ignore_errors=True)
        result, detector = self.map_with_network(prefix / "bin" / "stillmap")
        self.assertEqual(result.returncode, 0, result.text)
        self.assertIn("OpenCV", detector)
        self.assertEqual(result.stderr.count("libstillmap_openvino.so"), 1, result.stderr)
        self.assertIn("fix: ", result.stderr)

    def test_the_back_end_openvino_without_its_library_is_an_error_that_names_the_library(self):
        prefix = self.moved_prefix("without_openvino")
        plugins = prefix / ARGUMENTS.libdir / "stillmap"
        for library in plugins.glob("libopenvino.so*"):
            library.unlink()
        missing = "libopenvino.so" if ARGUMENTS.openvino == "1" else "libstillmap_openvino.so"
        result, _ = self.map_with_network(prefix / "bin" / "stillmap", "--set", "network.backend=openvino")
        self.assertEqual(result.returncode, 1, result.text)
        self.assertIn(missing, result.stderr)
        self.assertIn("fix: ", result.stderr)

    def test_the_back_end_onnxruntime_without_its_library_is_an_error_that_says_how_to_install_it(self):
        result, _ = self.map_with_network(self.program, "--set", "network.backend=onnxruntime")
        self.assertEqual(result.returncode, 1, result.text)
        self.assertIn("/nowhere", result.stderr)
        self.assertIn("pip install onnxruntime", result.stderr)

    def test_another_project_builds_with_the_library_and_runs(self):
        build = FOLDER / "project_build"
        configured = run(ARGUMENTS.cmake, "-S", FOLDER / "project", "-B", build, "-DCMAKE_BUILD_TYPE=Release",
                         f"-DCMAKE_PREFIX_PATH={self.prefix}", f"-DSTILLMAP_TEST_HEADERS={ARGUMENTS.headers}")
        self.assertEqual(configured.returncode, 0, configured.text)
        self.assertNotIn("Warning", configured.text)
        built = run(ARGUMENTS.cmake, "--build", build)
        self.assertEqual(built.returncode, 0, built.text)
        results = FOLDER / "project_results"
        result = run(build / "installed_package_test", self.network, results)
        self.assertEqual(result.returncode, 0, result.text)
        self.assertIn("OpenVINO" if ARGUMENTS.openvino == "1" else "OpenCV", result.stdout)
        self.assertEqual(json.loads((results / "summary.json").read_text())["frames"]["total"], 1)
        self.assertTrue((results / "report.html").is_file())


def install(arguments, folder):
    result = run(arguments.cmake, "--install", arguments.build, "--prefix", folder / "prefix")
    odd = [line for line in result.text.splitlines()
           if line and not line.startswith(("-- Install configuration", "-- Installing: ", "-- Set runtime path of"))]
    if result.returncode != 0 or odd:
        raise SystemExit("cmake --install: " + "\n".join(odd))
    shutil.copytree(Path(__file__).parent, folder / "project", ignore=shutil.ignore_patterns("__pycache__"))


def command_in_namespace(arguments, folder):
    """The command that runs the tests of this file with the folders hidden, or None where mounts are not permitted."""
    if run("unshare", "--mount", "mount", "-t", "tmpfs", "none", folder / "project").returncode != 0:
        return None
    mounts = "".join(f"mount -t tmpfs none '{path}' && " for path in reversed(hidden_folders(arguments)))
    script = folder / "project" / Path(__file__).name
    return ["unshare", "--mount", "sh", "-c", mounts + f'exec "$0" "{script}" "$@"', sys.executable,
            *sys.argv[1:], "--hidden-in", str(folder)]


def run_tests():
    return 0 if unittest.main(argv=["install_test"], exit=False).result.wasSuccessful() else 1


def main():
    global ARGUMENTS, FOLDER
    ARGUMENTS = parse(sys.argv[1:])
    if ARGUMENTS.hidden_in:
        FOLDER = Path(ARGUMENTS.hidden_in)
        for path in hidden_folders(ARGUMENTS):
            assert not os.path.isdir(path) or not os.listdir(path), f"{path} is not hidden"
        return run_tests()
    with tempfile.TemporaryDirectory() as folder:
        FOLDER = Path(folder)
        install(ARGUMENTS, FOLDER)
        command = command_in_namespace(ARGUMENTS, FOLDER)
        if command:
            return subprocess.run(command, check=False, cwd="/").returncode
        print("source and build folders are not hidden: no right to mount")
        return run_tests()


if __name__ == "__main__":
    sys.exit(main())
