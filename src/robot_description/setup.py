# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "robot_description",
            "robot_description.ros",
        ],
        package_dir={"": "src"},
    )
)
