# SPDX-License-Identifier: BSD-3-Clause
"""The joint planner on a grid: unit steps, no turning, and the classical conflicts."""
