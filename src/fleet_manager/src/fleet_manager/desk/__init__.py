# SPDX-License-Identifier: BSD-3-Clause
"""The logic of the windows and of RViz's markers, as plain values: no ROS, no Qt."""
