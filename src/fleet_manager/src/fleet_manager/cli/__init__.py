# SPDX-License-Identifier: BSD-3-Clause
"""The `hive` command line; what it needs of ROS is handed to it by `ros.command_line`."""
