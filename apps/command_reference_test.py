#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The manual page and the shell completion that the command writes name every command and option of its help.

  apps/command_reference_test.py PROGRAM     PROGRAM: the built command
"""
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM = ""


def stillmap(*arguments):
    result = subprocess.run([PROGRAM, *arguments], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def section(help_text, title):
    """The first lines of the entries of one section of a help text; their other lines are indented further."""
    match = re.search(rf"^{title}:\n((?:  .*\n)*)", help_text, re.MULTILINE)
    return [line for line in match.group(1).splitlines() if not line.startswith("   ")] if match else []


def commands(*path):
    """Returns (path, help) of a command and of all its subcommands, as listed by --help."""
    help_text = stillmap(*path, "--help")
    yield path, help_text
    for line in section(help_text, "Subcommands"):
        name = re.match(r"  (\S+)", line)
        if name:
            yield from commands(*path, name.group(1))


def option_names(help_text):
    """The options of all groups."""
    for line in re.split(r"^(?:Presets|Examples?|Files):", help_text, flags=re.MULTILINE)[0].splitlines():
        match = re.match(r"  (-\S+)", line)
        if match:
            yield from match.group(1).split(",")


def complete_in_bash(script, *words):
    """The words that bash offers for a command line whose last word is being typed."""
    line = " ".join(f"'{word}'" for word in words)
    program = f'source "{script}"; COMP_WORDS=({line}); COMP_CWORD={len(words) - 1}; _stillmap; printf "%s\\n" "${{COMPREPLY[@]}}"'
    result = subprocess.run(["bash", "--norc", "-uec", program], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout.split()


def complete_in_zsh(script, *words):
    """The words that zsh offers. The functions of its completion system are replaced by ones that print the words."""
    line = " ".join(f"'{word}'" for word in words)
    program = f'''
        _describe() {{ local entry; for entry in "${{(@P)argv[-1]}}"; do print -r -- "${{entry%%:*}}"; done }}
        compadd() {{ shift; print -rl -- "$@" }}
        _files() {{ }}
        source "{script}"; words=({line}); CURRENT={len(words)}; _stillmap'''
    result = subprocess.run(["zsh", "-fec", program], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, ""), result.stderr
    return [word for word in result.stdout.split() if word.startswith(words[-1])]


class ManualPage(unittest.TestCase):
    def test_names_every_command_and_option(self):
        page = stillmap("man").replace("\\-", "-")
        for path, help_text in commands():
            title = "\\fB" + " ".join(("stillmap", *path)) + "\\fR"
            self.assertIn(".SS " + title, page)
            text = page.split(".SS " + title)[1].split(".SS ")[0]
            for name in option_names(help_text):
                self.assertIn(f"\\fB{name}\\fR", text, path)

    def test_roff_finds_no_fault(self):
        groff = shutil.which("groff")
        if not groff:
            self.skipTest("there is no groff")
        result = subprocess.run([groff, "-man", "-Tutf8", "-ww", "-z"], input=stillmap("man"), capture_output=True,
                                text=True, check=False)
        self.assertEqual((result.returncode, result.stderr), (0, ""))


class Completion:
    """Tests of the completion of one shell."""
    shell = ""

    @classmethod
    def setUpClass(cls):
        if not shutil.which(cls.shell):
            raise unittest.SkipTest(f"there is no {cls.shell}")
        cls.folder = tempfile.TemporaryDirectory()
        cls.script = Path(cls.folder.name) / "stillmap"
        cls.script.write_text(stillmap("completion", cls.shell), encoding="utf-8")

    @classmethod
    def tearDownClass(cls):
        if hasattr(cls, "folder"):
            cls.folder.cleanup()

    def complete(self, *words):
        return {"bash": complete_in_bash, "zsh": complete_in_zsh}[self.shell](self.script, *words)

    def test_offers_every_command_and_option(self):
        for path, help_text in commands():
            with self.subTest(path=path):
                offered = self.complete("stillmap", *path, "-")
                self.assertEqual(sorted(offered), sorted(option_names(help_text)))
                names = [re.match(r"  (\S+)", line).group(1) for line in section(help_text, "Subcommands")]
                offered = [word for word in self.complete("stillmap", *path, "") if word[0] != "-"]
                self.assertEqual(sorted(offered), sorted(names))

    def test_completes_a_partial_word(self):
        self.assertEqual(self.complete("stillmap", "sim"), ["simulate"])
        self.assertIn("--load-map", self.complete("stillmap", "run", "folder", "--load"))

    def test_leaves_values_and_arguments_to_file_names(self):
        self.assertEqual(self.complete("stillmap", "run", "--config", ""), [])
        self.assertEqual(self.complete("stillmap", "run", ""), [])

    def test_offers_the_values_of_a_list(self):
        self.assertEqual(self.complete("stillmap", "run", "--schedule", ""), ["lockstep", "realtime"])
        self.assertEqual(self.complete("stillmap", "run", "--preset", "box"), ["box-epipolar", "box-flow"])
        self.assertEqual(self.complete("stillmap", "simulate", "--activity", "w"), ["walk", "wave"])
        for command in ("run", "doctor", "eval"):
            self.assertEqual(self.complete("stillmap", command, "--camera", "tum_fr"), ["tum_fr1", "tum_fr2", "tum_fr3"])


class BashCompletion(Completion, unittest.TestCase):
    shell = "bash"


class ZshCompletion(Completion, unittest.TestCase):
    shell = "zsh"


if __name__ == "__main__":
    PROGRAM = str(Path(sys.argv.pop()).resolve())
    unittest.main()
