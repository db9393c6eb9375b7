# SPDX-License-Identifier: BSD-3-Clause
"""The `hive` command line, without ROS: `ros.command_line` hands it the link."""
