# SPDX-License-Identifier: BSD-3-Clause
"""Breaks one thing in every node that is started with this folder on PYTHONPATH.

Python imports a module of this name by itself. Which thing, says the environment variable
HIVE_BREAK; see `hive_breaks.BREAKS`.
"""

import os

from hive_breaks import BREAKS

if os.environ.get("HIVE_BREAK"):
    BREAKS[os.environ["HIVE_BREAK"]].do()
