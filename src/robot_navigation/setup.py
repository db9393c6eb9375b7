# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "robot_navigation",
            "robot_navigation.control",
            "robot_navigation.localization",
            "robot_navigation.mapf",
            "robot_navigation.mapping",
            "robot_navigation.planning",
            "robot_navigation.ros",
            "robot_navigation.traffic",
        ],
        package_dir={"": "src"},
    )
)
