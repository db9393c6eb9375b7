# SPDX-License-Identifier: BSD-3-Clause
"""Finds out whether windows can be opened."""

from __future__ import annotations

import ctypes
import os


def screen_is_usable() -> bool:
    """Return whether DISPLAY names an X server that lets this process in.

    A DISPLAY that is set proves little: in a container or behind ssh it often leads nowhere, and
    RViz would end the whole demo.
    """
    if not os.environ.get("DISPLAY"):
        return False
    try:
        x11 = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    x11.XOpenDisplay.restype = ctypes.c_void_p
    x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
    x11.XCloseDisplay.argtypes = [ctypes.c_void_p]
    display = x11.XOpenDisplay(None)
    if not display:
        return False
    x11.XCloseDisplay(display)
    return True
