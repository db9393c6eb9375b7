# SPDX-License-Identifier: BSD-3-Clause
"""What a simulated fleet consists of and how it is set up, and what of that a schedule uses."""
