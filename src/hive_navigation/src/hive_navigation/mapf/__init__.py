# SPDX-License-Identifier: BSD-3-Clause
"""Joint planning for all robots: who drives where, and who passes a place first.

The planner knows robots by what they announce, and holds no state that it cannot rebuild from it.
Safety does not depend on it: `hive_navigation.traffic` keeps robots apart whatever it says.
"""
