# SPDX-License-Identifier: BSD-3-Clause
"""Which messages of ROS hold what operators' programs hear and say."""
