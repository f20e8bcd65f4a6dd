#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that the modules depend on each other exactly as docs/architecture.md says.

The block ```dependencies of that page has one line per module: the module, a colon, and the modules that its production
code includes. This script compares the line with

  1. the DEPENDS of stillmap_module(NAME DEPENDS ... TEST_DEPENDS ...) in the module's CMakeLists.txt;
  2. the includes of the module's production files.

All three must be equal: nothing undeclared is included, and nothing is declared that is not used. Tests and benchmarks
(*_test.cpp, *_benchmark.cpp, and headers of the module that only tests include) may include in addition whatever is reached from
DEPENDS and TEST_DEPENDS. A block ```mermaid, if the page has one, must draw the same graph without its implied arrows.

Prints file:line for every violation; exit code 1 if there is one.

  scripts/check_dependencies.py [ROOT]        check the tree at ROOT (default: this repository)
  scripts/check_dependencies.py --print       print both blocks as the code is now
  scripts/check_dependencies.py --self-test   check this script on small trees with known faults
"""
import re
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

PAGE = "docs/architecture.md"
LIST_BLOCK = re.compile(r"^```dependencies\n(.*?)^```", re.MULTILINE | re.DOTALL)
DRAWING_BLOCK = re.compile(r"^```mermaid\n(.*?)^```", re.MULTILINE | re.DOTALL)
MODULE_CALL = re.compile(r"^\s*stillmap_module\s*\(([^)]*)\)", re.MULTILINE)
KEYWORD = re.compile(r"[A-Z_]+")
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"')
PUBLIC_HEADER = re.compile(r"^stillmap/\w+\.hpp$")  # every module may include these
PUBLIC_HEADERS_OF = {"stillmap/evaluate.hpp": "evaluate", "stillmap/options.hpp": "config",
                     "stillmap/write_results.hpp": "report"}  # unless a module implements them
TEST_SOURCE = re.compile(r"_(test|benchmark)\.(cpp|hpp)$")


@dataclass
class Include:
    """An #include "..." of a file."""

    line: int
    path: str

    @property
    def module(self):
        """The included module; None where the path does not name one in full."""
        if self.path in PUBLIC_HEADERS_OF:
            return PUBLIC_HEADERS_OF[self.path]
        parts = self.path.split("/")
        return parts[1] if parts[0] == "stillmap" and len(parts) > 2 and ".." not in parts else None


@dataclass
class Module:
    """Declarations of a module's CMakeLists.txt, with their lines, and the includes of its files."""

    name: str
    cmake_file: Path
    depends: dict = field(default_factory=dict)
    test_depends: dict = field(default_factory=dict)
    includes: dict = field(default_factory=dict)  # of production files
    test_includes: dict = field(default_factory=dict)

    def used(self):
        """Other modules that the production files include."""
        return {i.module for includes in self.includes.values() for i in includes if i.module} - {self.name}

    def used_by_tests(self):
        return {i.module for includes in self.test_includes.values() for i in includes if i.module}


# ------------------------------------------------------------------------------------------------------- reading


def read_list(root):
    """Module -> (modules that it may include, line in the page)."""
    text = (root / PAGE).read_text(encoding="utf-8")
    block = LIST_BLOCK.search(text)
    if not block:
        raise SystemExit(f"{PAGE}: the block ```dependencies is missing")
    first = text.count("\n", 0, block.start(1)) + 1
    lines = [(number, line.split(":")) for number, line in enumerate(block.group(1).splitlines(), first) if line.strip()]
    return {words[0].strip(): (set(words[1].split()) if len(words) > 1 else set(), number) for number, words in lines}


def read_drawing(root):
    """Arrows of the drawing, as (used, user); None where the page has no drawing."""
    block = DRAWING_BLOCK.search((root / PAGE).read_text(encoding="utf-8"))
    return set(re.findall(r"(\w+)\s*-->\s*(\w+)", block.group(1))) if block else None


def read_module(cmake_file):
    """The stillmap_module call of one CMakeLists.txt; None if there is none."""
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
        if KEYWORD.fullmatch(word):
            current = lists.get(word, {})
        else:
            current[word] = line
    return module


def read_includes(file):
    found = enumerate(map(INCLUDE.match, file.read_text(encoding="utf-8").splitlines()), 1)
    return [Include(number, match.group(1)) for number, match in found if match]


def test_files(includes, root):
    """Tests, benchmarks, and helper headers: all their includers are such files, one of them in the same folder."""
    tests = {file for file in includes if TEST_SOURCE.search(file.name)}
    includers = {}
    for file, of_file in includes.items():
        for include in of_file:
            includers.setdefault(root / include.path, set()).add(file)
    while True:
        more = {file for file in includes if file not in tests and includers.get(file, {None}) <= tests
                and any(includer.parent == file.parent for includer in includers[file])}
        if not more:
            return tests
        tests |= more


def read_modules(root):
    modules = {m.name: m for m in map(read_module, sorted(root.glob("stillmap/*/CMakeLists.txt"))) if m}
    files = [file for top in ("stillmap", "apps", "lab") for file in (root / top).rglob("*.[ch]pp")]
    includes = {file: read_includes(file) for file in sorted(files)}
    tests = test_files(includes, root)
    for module in modules.values():
        for file in includes:
            if file.is_relative_to(module.cmake_file.parent):
                (module.test_includes if file in tests else module.includes)[file] = includes[file]
    return modules


# ------------------------------------------------------------------------------------------------------ checking


def reach(modules, edges):
    """All modules that can be got to from `modules` along `edges`, with themselves."""
    reached, open_ends = set(), list(modules)
    while open_ends:
        module = open_ends.pop()
        if module not in reached:
            reached.add(module)
            open_ends.extend(edges.get(module, ()))
    return reached


def list_faults(modules, listed, page):
    """Differences between the page, the CMake files and the includes."""
    for name, (_, line) in listed.items():
        if name not in modules:
            yield page, line, f"{name} is listed, but there is no such module"
    for module in modules.values():
        if module.cmake_file.parent.name != module.name:
            yield module.cmake_file, 1, f"module {module.name} is in folder {module.cmake_file.parent.name}"
        if module.name not in listed:
            yield module.cmake_file, 1, f"module {module.name} is not listed in {PAGE}"
            continue
        allowed, line = listed[module.name]
        for used, at in module.depends.items():
            if used not in allowed:
                yield module.cmake_file, at, f"{module.name} depends on {used}, which {PAGE} does not list for it"
        for used in sorted(allowed - set(module.depends)):
            yield page, line, f"{module.name}: {used} is listed, but is not among its DEPENDS"
        for used in sorted(allowed - module.used()):
            yield page, line, f"{module.name}: {used} is listed, but no production file includes it"
        for used, at in module.test_depends.items():
            if used not in module.used_by_tests():
                yield module.cmake_file, at, f"{module.name} has {used} in TEST_DEPENDS, but no test includes it"


def include_faults(modules, listed):
    """Includes of modules that the file may not use."""
    edges = {module.name: module.depends for module in modules.values()}
    for module in modules.values():
        own = {module.name} | listed.get(module.name, (set(), 0))[0]
        with_tests = {module.name} | reach(module.depends, edges) | reach(module.test_depends, edges)
        for includes, usable in ((module.includes, own), (module.test_includes, with_tests)):
            for file, of_file in includes.items():
                for include in of_file:
                    if include.module is None and PUBLIC_HEADER.match(include.path):
                        continue
                    if include.module is None:
                        yield file, include.line, f'"{include.path}": write includes in full, "stillmap/<module>/<file>"'
                    elif include.module not in usable:
                        yield file, include.line, f"{module.name} includes {include.module}, which it does not depend on"


def cycle_faults(listed, page):
    edges = {name: allowed for name, (allowed, _) in listed.items()}
    for name, (allowed, line) in listed.items():
        if name in reach(allowed, edges):
            yield page, line, f"{name} depends on itself in the end"


def without_implied(edges):
    """Arrows (used, user) of a graph, without those that follow from others."""
    def implied(user, used):
        return any(used in reach([other], edges) for other in edges[user] if other != used)
    return {(used, user) for user in edges for used in edges[user] if not implied(user, used)}


def drawing_faults(root, listed, page):
    drawn = read_drawing(root)
    if drawn is None:
        return
    wanted = without_implied({name: allowed for name, (allowed, _) in listed.items()})
    for used, user in sorted(wanted - drawn):
        yield page, 1, f"the drawing lacks {used} --> {user}"
    for used, user in sorted(drawn - wanted):
        yield page, 1, f"the drawing has {used} --> {user}, which is implied or not listed"


def find_faults(root):
    listed, modules, page = read_list(root), read_modules(root), root / PAGE
    faults = [*list_faults(modules, listed, page), *include_faults(modules, listed), *cycle_faults(listed, page)]
    if not faults:
        faults = [*drawing_faults(root, listed, page)]
    return [f"{file.relative_to(root)}:{line}: {text}" for file, line, text in faults], len(modules)


# --------------------------------------------------------------------------------------------------------- output


def in_order(edges):
    """Modules, each after those that it uses."""
    ordered = []
    while len(ordered) < len(edges):
        ready = [name for name in edges if name not in ordered and edges[name] <= set(ordered)]
        if not ready:
            raise SystemExit("the modules use each other in a cycle")
        ordered.append(ready[0])
    return ordered


def print_blocks(root):
    edges = {module.name: module.used() for module in read_modules(root).values()}
    ordered = in_order(edges)
    print("```dependencies")
    for name in ordered:
        print(f"{name}: {' '.join(sorted(edges[name], key=ordered.index))}".rstrip())
    print("```\n\n```mermaid\ngraph LR")
    for used, user in sorted(without_implied(edges), key=lambda arrow: [ordered.index(name) for name in arrow]):
        print(f"  {used} --> {user}")
    print("```")
    return 0


def main(root):
    faults, count = find_faults(root)
    for fault in faults:
        print(fault)
    print(f"dependencies: {count} modules, {len(faults)} violations")
    return 1 if faults or count == 0 else 0


# --- Self-test: a small tree without faults, and one fault at a time built into it. ------------------------------

PAGE_TEXT = """```dependencies
base:
map: base
track: base map
refine: map
simulate: base
```

```mermaid
graph LR
  base --> map
  map --> track
  map --> refine
  base --> simulate
```
"""

SOUND_TREE = {
    PAGE: PAGE_TEXT,
    "stillmap/base/CMakeLists.txt": "stillmap_module(base)\n",
    "stillmap/base/a.hpp": "#include <vector>\n",
    "stillmap/map/CMakeLists.txt": "stillmap_module(map DEPENDS base LINK yaml-cpp TEST_DEPENDS simulate)\n",
    "stillmap/map/b.hpp": '#include "stillmap/base/a.hpp"\n',
    "stillmap/map/b_test.cpp": '#include "stillmap/map/test_scene.hpp"\n',
    "stillmap/map/test_scene.hpp": '#include "stillmap/simulate/s.hpp"\n',
    "stillmap/track/CMakeLists.txt": "stillmap_module(track  # a comment\n  DEPENDS base map)\n",
    "stillmap/track/c.cpp": '#include "stillmap/base/a.hpp"\n#include "stillmap/map/b.hpp"\n#include "stillmap/slam.hpp"\n',
    "stillmap/refine/CMakeLists.txt": "stillmap_module(refine DEPENDS map)\n",
    "stillmap/refine/d.cpp": '#include "stillmap/map/b.hpp"\n',
    "stillmap/simulate/CMakeLists.txt": "stillmap_module(simulate DEPENDS base)\n",
    "stillmap/simulate/s.hpp": '#include "stillmap/base/a.hpp"\n',
}

# The change to the sound tree, and the violation that must then be reported (None: nothing).
SELF_TESTS = {
    "a sound tree": ({}, None),
    "a reversed include": (
        {"stillmap/base/a.hpp": '// hm\n#include "stillmap/map/b.hpp"\n'}, "stillmap/base/a.hpp:2: base includes map"),
    "an include of a sibling": (
        {"stillmap/track/c.hpp": '#include "stillmap/refine/d.hpp"\n'}, "stillmap/track/c.hpp:1: track includes refine"),
    "an include of a module that is only reached through another": (
        {"stillmap/refine/d.cpp": '#include "stillmap/map/b.hpp"\n#include "stillmap/base/a.hpp"\n'},
        "stillmap/refine/d.cpp:2: refine includes base"),
    "a test's module in a production file": (
        {"stillmap/map/b.cpp": '#include "stillmap/simulate/s.hpp"\n'}, "stillmap/map/b.cpp:1: map includes simulate"),
    "a test header that production code includes": (
        {"stillmap/map/b.cpp": '#include "stillmap/map/test_scene.hpp"\n'},
        "stillmap/map/test_scene.hpp:1: map includes simulate"),
    "a relative include": (
        {"stillmap/base/a.hpp": '#include "../map/b.hpp"\n'}, "stillmap/base/a.hpp:1: \"../map/b.hpp\""),
    "DEPENDS that is not listed": (
        {"stillmap/base/CMakeLists.txt": "\nstillmap_module(base DEPENDS\n map)\n"},
        "stillmap/base/CMakeLists.txt:3: base depends on map, which"),
    "a listed module that is not in DEPENDS": (
        {"stillmap/track/CMakeLists.txt": "stillmap_module(track DEPENDS base)\n"},
        f"{PAGE}:4: track: map is listed, but is not among its DEPENDS"),
    "a listed module that no production file includes": (
        {"stillmap/track/c.cpp": '#include "stillmap/map/b.hpp"\n',
         "stillmap/track/c_test.cpp": '#include "stillmap/base/a.hpp"\n'},
        f"{PAGE}:4: track: base is listed, but no production file includes it"),
    "TEST_DEPENDS that no test includes": (
        {"stillmap/map/test_scene.hpp": ""}, "stillmap/map/CMakeLists.txt:1: map has simulate in TEST_DEPENDS"),
    "a cycle in the list": (
        {PAGE: PAGE_TEXT.replace("base:\n", "base: track\n")}, f"{PAGE}:2: base depends on itself in the end"),
    "a listed module that does not exist": (
        {PAGE: PAGE_TEXT.replace("refine: map\n", "refine: map\nattic: map\n")}, "attic is listed, but there is no"),
    "a module that the list lacks": (
        {"stillmap/attic/CMakeLists.txt": "stillmap_module(attic DEPENDS base)\n"}, "module attic is not listed"),
    "an arrow that the drawing lacks": (
        {PAGE: PAGE_TEXT.replace("  map --> track\n", "")}, "the drawing lacks map --> track"),
    "an arrow that is implied": (
        {PAGE: PAGE_TEXT.replace("  map --> track\n", "  map --> track\n  base --> track\n")},
        "the drawing has base --> track"),
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
    if sys.argv[1:] == ["--print"]:
        sys.exit(print_blocks(Path(__file__).resolve().parent.parent))
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent.parent).resolve()))
