# SPDX-License-Identifier: BSD-3-Clause
"""The operator's windows: thin Qt widgets over `fleet_manager.desk`."""
