# SPDX-License-Identifier: BSD-3-Clause
"""Operators' programs on a hive over Zenoh, where no ROS master is needed."""
