# SPDX-License-Identifier: BSD-3-Clause
"""What of the robots depends on ROS."""
