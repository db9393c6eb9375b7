# SPDX-License-Identifier: BSD-3-Clause
"""What all levels of tests share: a calculation without a result is an error.

In nodes, which are other processes, `./hive test` makes Python's warning about it an error.
"""

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def _no_invalid_values():
    """Let infinity minus infinity, the root of -1 and the like fail the test."""
    with np.errstate(invalid="raise"):
        yield
