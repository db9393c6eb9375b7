# SPDX-License-Identifier: BSD-3-Clause
"""Whole hives on a simulated network with every kind of fault, checked after every event."""
