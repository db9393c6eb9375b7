# SPDX-License-Identifier: BSD-3-Clause
"""Experiments: the same tasks under several ways to decide, and their results side by side."""
