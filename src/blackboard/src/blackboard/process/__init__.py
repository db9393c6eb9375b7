# SPDX-License-Identifier: BSD-3-Clause
"""One process of the hive: its queue, timers and members, whatever carries its messages."""
