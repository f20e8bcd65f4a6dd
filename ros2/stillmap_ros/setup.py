# SPDX-License-Identifier: Apache-2.0
from glob import glob

from setuptools import setup

NAME = "stillmap_ros"

setup(
    name=NAME,
    version="0.3.0",
    packages=[NAME],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", glob("launch/*.py")),
        (f"share/{NAME}/config", glob("config/*")),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    description="Visual RGB-D SLAM for scenes in which things move, as a node that Nav2 can use.",
    license="Apache-2.0",
    entry_points={"console_scripts": ["stillmap_node = stillmap_ros.node:main"]},
)
