# SPDX-License-Identifier: BSD-3-Clause
"""The certificates of a site: who may take part in its hive over Zenoh, and as what."""
