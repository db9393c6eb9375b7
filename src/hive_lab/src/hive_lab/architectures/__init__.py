# SPDX-License-Identifier: BSD-3-Clause
"""Ways to build a fleet manager, side by side: the hive's and others, made of the hive's parts."""
