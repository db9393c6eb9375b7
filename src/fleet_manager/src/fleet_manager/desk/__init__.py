# SPDX-License-Identifier: BSD-3-Clause
"""What an operator sees and fills in, as plain values: no ROS, no Qt."""
