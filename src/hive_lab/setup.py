# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "hive_lab",
            "hive_lab.agvs",
            "hive_lab.allocation",
            "hive_lab.architectures",
            "hive_lab.bench",
            "hive_lab.bench.allocation",
            "hive_lab.bench.architectures",
            "hive_lab.bench.scale",
            "hive_lab.bench.traffic",
            "hive_lab.compare",
            "hive_lab.fault_schedules",
            "hive_lab.fault_schedules.features",
            "hive_lab.fault_schedules.mutations",
            "hive_lab.fleets",
            "hive_lab.fuzz",
            "hive_lab.live",
            "hive_lab.mapf",
            "hive_lab.runner",
            "hive_lab.virtual",
            "hive_lab.windows",
        ],
        package_dir={"": "src"},
    )
)
