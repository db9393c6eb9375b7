# SPDX-License-Identifier: BSD-3-Clause
"""The recorded list of all interfaces, `test/rostest/interfaces.yaml`: compared, and renewed.

Its sections are mappings, lists and values, each under the name by which a user knows it.
"""

import os
from pathlib import Path

import pytest
import yaml

FILE = Path(__file__).resolve().parents[2] / "interfaces.yaml"
RECORDS = bool(os.environ.get("HIVE_RECORD_INTERFACES"))
"""Whether the list is renewed, instead of compared."""
NO_ALIASES = type("NoAliases", (yaml.SafeDumper,), {"ignore_aliases": lambda *_: True})
"""Writes a list out wherever it occurs."""
RENEW = (
    "HIVE_RECORD_INTERFACES=1 ./hive test test/unit/test_interfaces.py "
    "test/rostest/interfaces.test"
)
HEAD = f"""\
# What users and their programs rely on: every topic, type, service, action, parameter, launch
# argument and name. Made from the files and from running systems; tests compare. Renew it with
#   {RENEW}
# and read the difference before you commit it.
"""


def recorded(section):
    """Return a section of the list; nothing where it is to be recorded anew."""
    return None if RECORDS else read().get(section, {})


def read():
    """Return the whole list."""
    return yaml.safe_load(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}


def check(section, found):
    """Compare what was found with a section of the list, or record it there.

    Raises:
        pytest.fail.Exception: It differs; the text names what is missing, new or changed.
    """
    if RECORDS:
        text = yaml.dump(
            read() | {section: found}, Dumper=NO_ALIASES, width=99, default_flow_style=None
        )
        FILE.write_text(HEAD + text, encoding="utf-8")
        pytest.skip(f"recorded the section {section}")
    told = list(differences(recorded(section), found))
    if told:
        lines = "\n".join(f"  {section}: {line}" for line in told)
        pytest.fail(
            f"{len(told)} interfaces differ from {FILE.name}:\n{lines}\n"
            f"Where users are meant to notice, renew the list: {RENEW}",
            pytrace=False,
        )


def differences(before, now, where=""):
    """Yield a line for each thing that is missing, new or changed."""
    if isinstance(before, dict) and isinstance(now, dict):
        yield from (f"{where}missing: {key}" for key in before if key not in now)
        yield from (f"{where}new: {key}: {now[key]}" for key in now if key not in before)
        for key in before:
            if key in now:
                yield from differences(before[key], now[key], f"{where}{key}: ")
    elif _is_list_of_names(before) and _is_list_of_names(now):
        yield from (f"{where}missing: {each}" for each in before if each not in now)
        yield from (f"{where}new: {each}" for each in now if each not in before)
        if before != now and set(before) == set(now):
            yield f"{where}changed: was {before}, is {now}"
    elif before != now or type(before) is not type(now):
        yield f"{where}changed: was {before!r}, is {now!r}"


def _is_list_of_names(value):
    return isinstance(value, list) and all(isinstance(each, str) for each in value)
