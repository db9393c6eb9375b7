# SPDX-License-Identifier: BSD-3-Clause
"""Runs a scenario on a simulated hive, and writes a report and a picture."""
