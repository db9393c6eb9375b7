# SPDX-License-Identifier: BSD-3-Clause
"""Who does which task, and in which order: auction, objectives, search, and simple rules."""
