# SPDX-License-Identifier: BSD-3-Clause
"""The hive beside other ways to build a fleet manager."""
