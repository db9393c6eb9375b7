# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "hive_navigation",
            "hive_navigation.control",
            "hive_navigation.localization",
            "hive_navigation.mapf",
            "hive_navigation.mapping",
            "hive_navigation.planning",
            "hive_navigation.ros",
            "hive_navigation.traffic",
        ],
        package_dir={"": "src"},
    )
)
