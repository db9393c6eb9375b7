# SPDX-License-Identifier: BSD-3-Clause
"""Compiles inner loops to machine code (docs/decisions/091).

The compiled code is kept beside the source, in `__pycache__`, or in the user's cache folder where
the source is read-only. `./hive setup` fills it, so no node compiles when it starts.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

Function = TypeVar("Function", bound="Callable[..., object]")


def compiled(*signatures: str) -> Callable[[Function], Function]:
    """Compile a function of numbers and arrays as soon as its module is imported.

    It runs without the interpreter's lock, and gives the same result for the same arguments on
    every run: no reordering of sums, no threads. Divisions by zero give infinity or NaN, as in
    numpy.

    Args:
        signatures: The types of its arguments and result in numba's notation, for example
            `float64(float64[:, ::1], int64)`; without one, it compiles for the types of each
            caller that is compiled itself.
    """

    def compile_it(function: Function) -> Function:
        made: Function = numba.njit(
            list(signatures) or None, cache=True, nogil=True, error_model="numpy"
        )(function)
        return made

    return compile_it
