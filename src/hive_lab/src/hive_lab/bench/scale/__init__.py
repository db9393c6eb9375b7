# SPDX-License-Identifier: BSD-3-Clause
"""What a hive costs over its size."""
