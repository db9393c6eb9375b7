# SPDX-License-Identifier: BSD-3-Clause
"""Changes of the program that fault schedules have to notice.

Each function removes one rule of the protocol, or puts a past mistake back. It is named after what
the program does then. docs/protocol.md lists all of them with the schedules that notice them.
"""
