# SPDX-License-Identifier: BSD-3-Clause
"""Standard problems of multi-agent path finding (MAPF): files, runs and an independent check.

On a grid, time goes in steps. In a step a robot moves to one of four neighbours or stays. Two
robots must neither be in one cell nor change places.
"""
