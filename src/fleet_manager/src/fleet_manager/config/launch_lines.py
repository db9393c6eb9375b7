# SPDX-License-Identifier: BSD-3-Clause
"""Lines of launch files."""

from __future__ import annotations

import json
from xml.sax.saxutils import escape, quoteattr


def yaml_line(name: str, value: object) -> str:
    """Return the line that sets a parameter, or those below it, to a value."""
    return f"  <rosparam param={quoteattr(name)}>{escape(json.dumps(value))}</rosparam>"
