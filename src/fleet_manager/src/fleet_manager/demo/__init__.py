# SPDX-License-Identifier: BSD-3-Clause
"""Runs a whole hive on a scenario by itself, and leaves a report and a picture of it."""
