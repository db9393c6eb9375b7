# SPDX-License-Identifier: BSD-3-Clause
"""The hive as a program outside it sees it: its state, in words and tables, and a client.

What only the windows need belongs to `desk`. No ROS, no Qt.
"""
