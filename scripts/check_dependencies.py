#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the modules against the dependency graph of the project.

The dependencies are drawn once, in the block ```dependencies of docs/architecture.md. A module may use another only if
the dependencies lead from that one to it. This script compares with them

  1. what each module says it uses: stillmap_module(NAME DEPENDS ... TEST_DEPENDS ...) in its CMakeLists.txt;
  2. what its files really include: only the module itself and what its DEPENDS reach; tests, benchmarks and
     what lies in its folder tools/ also what its TEST_DEPENDS reach.

Prints file:line for every violation; exit code 1 if there is one.

  scripts/check_dependencies.py [ROOT]        check the tree at ROOT (default: this repository)
  scripts/check_dependencies.py --self-test   check this script on small trees with known faults
"""
import re
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

DRAWING_FILE = "docs/architecture.md"
DRAWING_BLOCK = re.compile(r"^```dependencies\n(.*?)^```", re.MULTILINE | re.DOTALL)
MODULE_CALL = re.compile(r"^\s*stillmap_module\s*\(([^)]*)\)", re.MULTILINE)
MODULE_KEYWORDS = {"DEPENDS", "TEST_DEPENDS", "LINK", "TEST_LINK", "NO_PCH"}
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"')
PUBLIC_HEADER = re.compile(r"^stillmap/\w+\.hpp$")
TEST_FILE = re.compile(r"_(test|benchmark)\.(cpp|hpp)$|/tools/")


@dataclass
class Module:
    """Declarations in a module's CMakeLists.txt; every name with its line number."""

    name: str
    cmake_file: Path
    depends: dict = field(default_factory=dict)
    test_depends: dict = field(default_factory=dict)


def read_dependencies(root):
    """Module -> set of the modules it may use, from the drawing in the documentation."""
    text = (root / DRAWING_FILE).read_text(encoding="utf-8")
    block = DRAWING_BLOCK.search(text)
    if not block:
        raise SystemExit(f"{DRAWING_FILE}: the block ```dependencies is missing")
    edges = {}
    for line in block.group(1).splitlines():
        steps = [re.findall(r"\w+", step) for step in line.split("->")]
        for modules in steps:
            for module in modules:
                edges.setdefault(module, set())
        for sources, targets in zip(steps, steps[1:]):
            for target in targets:
                edges[target].update(sources)
    return {module: reach(edges[module], edges) for module in edges}


def reach(modules, edges):
    """All that can be got to from `modules` along `edges`, with themselves."""
    reached, open_ends = set(), list(modules)
    while open_ends:
        module = open_ends.pop()
        if module not in reached:
            reached.add(module)
            open_ends.extend(edges.get(module, ()))
    return reached


def read_module(cmake_file):
    """The stillmap_module call of one CMakeLists.txt, or None."""
    text = re.sub(r"#.*", "", cmake_file.read_text(encoding="utf-8"))
    call = MODULE_CALL.search(text)
    if not call:
        return None
    words = [(m.group(), text.count("\n", 0, call.start(1) + m.start()) + 1)
             for m in re.finditer(r"\S+", call.group(1))]
    module = Module(words[0][0], cmake_file)
    lists = {"DEPENDS": module.depends, "TEST_DEPENDS": module.test_depends}
    current = {}
    for word, line in words[1:]:
        if word in MODULE_KEYWORDS:
            current = lists.get(word, {})
        else:
            current[word] = line
    return module


def read_modules(root):
    modules = [read_module(file) for file in sorted(root.glob("stillmap/*/CMakeLists.txt"))]
    return {module.name: module for module in modules if module}


def declared_faults(modules, allowed):
    """Violations in the declared dependencies."""
    for module in modules.values():
        if module.cmake_file.parent.name != module.name:
            yield module.cmake_file, 1, f"module {module.name} lies in folder {module.cmake_file.parent.name}"
        if module.name not in allowed:
            yield module.cmake_file, 1, f"module {module.name} is not in the drawing in {DRAWING_FILE}"
            continue
        for used, line in module.depends.items():
            if used not in allowed[module.name]:
                yield module.cmake_file, line, f"{module.name} -> {used} is against the dependencies in {DRAWING_FILE}"
        for used, line in {**module.depends, **module.test_depends}.items():
            if used not in modules:
                yield module.cmake_file, line, f"{module.name} depends on {used}, which is no module"


def cycle_faults(modules, allowed):
    """Modules that depend on themselves, in the drawing or in the CMake files."""
    edges = {module.name: module.depends for module in modules.values()}
    for module in modules.values():
        if module.name in allowed.get(module.name, ()):
            yield module.cmake_file, 1, f"the dependencies in {DRAWING_FILE} lead from {module.name} back to it"
        if module.name in reach(module.depends, edges):
            yield module.cmake_file, 1, f"{module.name} depends on itself in the end"


def include_faults(modules):
    """Violations in the actual includes."""
    edges = {module.name: module.depends for module in modules.values()}
    for module in modules.values():
        own = {module.name} | reach(module.depends, edges)
        with_tests = own | reach(module.test_depends, edges)
        for file in sorted(module.cmake_file.parent.rglob("*.[ch]pp")):
            usable = with_tests if TEST_FILE.search(file.as_posix()) else own
            yield from file_faults(file, module.name, usable)


def file_faults(file, module, usable):
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        include = INCLUDE.match(line)
        if not include:
            continue
        parts = include.group(1).split("/")
        if PUBLIC_HEADER.match(include.group(1)):
            continue
        if parts[0] != "stillmap" or len(parts) < 3 or ".." in parts:
            yield file, number, f'"{include.group(1)}": write includes in full, "stillmap/<module>/<file>"'
        elif parts[1] not in usable:
            yield file, number, f"{module} includes {parts[1]}, which is not among its dependencies"


def find_faults(root):
    allowed, modules = read_dependencies(root), read_modules(root)
    faults = [*declared_faults(modules, allowed), *cycle_faults(modules, allowed), *include_faults(modules)]
    return [f"{file.relative_to(root)}:{line}: {text}" for file, line, text in faults], len(modules)


def main(root):
    faults, module_count = find_faults(root)
    for fault in faults:
        print(fault)
    print(f"dependencies: {module_count} modules, {len(faults)} violations")
    return 1 if faults or module_count == 0 else 0


# --- Self-test: a small tree that is in order, and one fault at a time added to it. ---------------------

SOUND_TREE = {
    DRAWING_FILE: "```dependencies\nbase -> map -> track, refine -> top\nbase -> simulate\n```\n",
    "stillmap/base/CMakeLists.txt": "stillmap_module(base)\n",
    "stillmap/base/a.hpp": "#include <vector>\n",
    "stillmap/map/CMakeLists.txt": "stillmap_module(map DEPENDS base LINK yaml-cpp TEST_DEPENDS simulate)\n",
    "stillmap/map/b.hpp": '#include "stillmap/base/a.hpp"\n',
    "stillmap/map/b_test.cpp": '#include "stillmap/simulate/s.hpp"\n',
    "stillmap/track/CMakeLists.txt": "stillmap_module(track  # by way of map\n  DEPENDS map)\n",
    "stillmap/track/c.cpp": '#include "stillmap/base/a.hpp"\n#include "stillmap/map/b.hpp"\n',
    "stillmap/refine/CMakeLists.txt": "stillmap_module(refine DEPENDS map)\n",
    "stillmap/simulate/CMakeLists.txt": "stillmap_module(simulate DEPENDS base)\n",
    "stillmap/simulate/s.hpp": "",
    "stillmap/map/tools/t.cpp": '#include "stillmap/simulate/s.hpp"\n',
}

# The change made to the sound tree, and the fault that it must be reported as (None: no fault).
SELF_TESTS = {
    "a sound tree": ({}, None),
    "a reversed include": (
        {"stillmap/base/a.hpp": '// hm\n#include "stillmap/map/b.hpp"\n'}, "stillmap/base/a.hpp:2: base includes map"),
    "an include of a sibling": (
        {"stillmap/track/c.cpp": '#include "stillmap/refine/d.hpp"\n'}, "stillmap/track/c.cpp:1: track includes refine"),
    "a test's module in a file that is no test": (
        {"stillmap/map/b.hpp": '#include "stillmap/simulate/s.hpp"\n'}, "stillmap/map/b.hpp:1: map includes simulate"),
    "a relative include": (
        {"stillmap/base/a.hpp": '#include "../map/b.hpp"\n'}, "stillmap/base/a.hpp:1: \"../map/b.hpp\""),
    "DEPENDS against the dependencies": (
        {"stillmap/base/CMakeLists.txt": "\nstillmap_module(base DEPENDS\n map)\n"},
        "stillmap/base/CMakeLists.txt:3: base -> map is against"),
    "DEPENDS on a sibling": (
        {"stillmap/track/CMakeLists.txt": "stillmap_module(track DEPENDS map refine)\n"},
        "stillmap/track/CMakeLists.txt:1: track -> refine is against"),
    "a cycle of DEPENDS": (
        {"stillmap/base/CMakeLists.txt": "stillmap_module(base DEPENDS map)\n"}, "map depends on itself in the end"),
    "a cycle in the drawing": (
        {DRAWING_FILE: "```dependencies\nbase -> map -> track, refine -> base\nbase -> simulate\n```\n"}, "lead from base back"),
    "DEPENDS on what is no module": (
        {"stillmap/refine/CMakeLists.txt": "stillmap_module(refine DEPENDS top)\n"}, "which is no module"),
    "a module that the drawing lacks": (
        {"stillmap/attic/CMakeLists.txt": "stillmap_module(attic DEPENDS base)\n"}, "module attic is not in the drawing"),
}


def self_test():
    failures = 0
    for name, (changes, expected) in SELF_TESTS.items():
        with tempfile.TemporaryDirectory() as folder:
            root = Path(folder)
            for path, text in {**SOUND_TREE, **changes}.items():
                (root / path).parent.mkdir(parents=True, exist_ok=True)
                (root / path).write_text(text, encoding="utf-8")
            faults, _ = find_faults(root)
        passed = any(expected in fault for fault in faults) if expected else not faults
        failures += not passed
        print(f"{'ok    ' if passed else 'FAILED'} {name}" + ("" if passed else f": found {faults}"))
    return 1 if failures else 0


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        sys.exit(self_test())
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent).resolve()))
