# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "vda5050",
            "vda5050.agent",
            "vda5050.connector",
            "vda5050.mqtt",
            "vda5050.protocol",
            "vda5050.ros",
            "vda5050.simulated",
            "vda5050.vehicle",
        ],
        package_dir={"": "src"},
    )
)
