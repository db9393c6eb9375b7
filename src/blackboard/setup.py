# SPDX-License-Identifier: BSD-3-Clause
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(
    **generate_distutils_setup(
        packages=[
            "blackboard",
            "blackboard.auction",
            "blackboard.auction.search",
            "blackboard.board",
            "blackboard.codec",
            "blackboard.consensus",
            "blackboard.costing",
            "blackboard.domain",
            "blackboard.process",
            "blackboard.robot",
            "blackboard.ros",
            "blackboard.ros.rospy_patches",
            "blackboard.zenoh",
        ],
        package_dir={"": "src"},
    )
)
