# SPDX-License-Identifier: BSD-3-Clause
"""The commands `bench` and `compare`, which run programs of hive_lab; a hive may lack it."""

from __future__ import annotations

import os
import shutil

import click

from fleet_manager.errors import InputError

_PASSED_ON = {"ignore_unknown_options": True, "allow_interspersed_args": False}


@click.command(add_help_option=False, context_settings=_PASSED_ON)
@click.argument("words", nargs=-1, type=click.UNPROCESSED)
def bench(words: tuple[str, ...]) -> None:
    """Measure the system; without a NAME, list the benchmarks."""
    _become("bench", words)


@click.command(add_help_option=False, context_settings=_PASSED_ON)
@click.argument("words", nargs=-1, type=click.UNPROCESSED)
def compare(words: tuple[str, ...]) -> None:
    """Run experiments, and show ways to decide side by side."""
    _become("compare", words)


def _become(node: str, words: tuple[str, ...]) -> None:
    """Let a node of hive_lab take the place of this process."""
    program = shutil.which("rosrun")
    if program is None:
        raise InputError("rosrun was not found; run this in ./hive shell")
    os.execv(program, [program, "hive_lab", node, *words])  # noqa: S606  (rosrun of the sourced ROS)
