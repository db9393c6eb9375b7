# SPDX-License-Identifier: BSD-3-Clause
"""What users rely on in files is as recorded: messages, launch arguments, parameters, names.

`test/rostest/interfaces.test` compares the running system with the same list.
"""

import importlib
import sys
from pathlib import Path

import pytest

CASES = Path(__file__).resolve().parents[1] / "rostest" / "cases" / "interfaces"

sys.path.insert(0, str(CASES))
interface_files = importlib.import_module("interface_files")
interface_list = importlib.import_module("interface_list")
sys.path.pop(0)


def test_every_message_service_and_action_has_the_fields_that_are_recorded():
    interface_list.check("definitions", interface_files.message_definitions())


def test_every_launch_file_takes_the_arguments_that_are_recorded():
    interface_list.check("launch arguments", interface_files.launch_arguments())


def test_the_executables_are_those_that_are_recorded():
    interface_list.check("executables", interface_files.executables())


def test_every_parameter_file_has_the_parameters_and_defaults_that_are_recorded():
    interface_list.check("parameter files", interface_files.parameter_files())


def test_what_users_choose_by_name_is_what_is_recorded():
    interface_list.check("choices", interface_files.choices())


@pytest.mark.parametrize(
    ("before", "now", "told"),
    [
        ({"a": 1}, {}, ["missing: a"]),
        ({}, {"a": 1}, ["new: a: 1"]),
        ({"a": {"b": 1}}, {"a": {"b": 2}}, ["a: b: changed: was 1, is 2"]),
        ({"a": 1}, {"a": 1.0}, ["a: changed: was 1, is 1.0"]),
        (["x", "y"], ["y", "z"], ["missing: x", "new: z"]),
        (["x", "y"], ["y", "x"], ["changed: was ['x', 'y'], is ['y', 'x']"]),
        (["x", "x"], ["x"], ["changed: was ['x', 'x'], is ['x']"]),
        ([[0.0, 1.0]], [[0.0, 2.0]], ["changed: was [[0.0, 1.0]], is [[0.0, 2.0]]"]),
        ({"a": [["x"]]}, {"a": [["x"]]}, []),
    ],
)
def test_a_difference_is_told_in_a_line(before, now, told):
    assert list(interface_list.differences(before, now)) == told
