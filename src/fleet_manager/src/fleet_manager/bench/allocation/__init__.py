# SPDX-License-Identifier: BSD-3-Clause
"""Measures how good and how quick the allocation of tasks is."""
