# SPDX-License-Identifier: BSD-3-Clause
"""The operator's windows: thin Qt widgets over `desk` and `client`, which hold the logic."""
