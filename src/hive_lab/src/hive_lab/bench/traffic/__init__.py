# SPDX-License-Identifier: BSD-3-Clause
"""What the traffic planner is worth: alone on grids, in the simulator, and through ROS."""
