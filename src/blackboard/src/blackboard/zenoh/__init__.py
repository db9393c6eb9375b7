# SPDX-License-Identifier: BSD-3-Clause
"""The hive over Eclipse Zenoh: who may say what, and how to open a session."""
