# SPDX-License-Identifier: BSD-3-Clause
"""Measures what the system takes and how fast it is."""
