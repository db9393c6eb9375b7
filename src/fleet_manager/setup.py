# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "fleet_manager",
            "fleet_manager.certs",
            "fleet_manager.cli",
            "fleet_manager.client",
            "fleet_manager.codec",
            "fleet_manager.config",
            "fleet_manager.demo",
            "fleet_manager.desk",
            "fleet_manager.gui",
            "fleet_manager.gui.benchmarks",
            "fleet_manager.ros",
            "fleet_manager.zenoh",
        ],
        package_dir={"": "src"},
    )
)
