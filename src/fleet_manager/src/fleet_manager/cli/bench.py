# SPDX-License-Identifier: BSD-3-Clause
"""The command `bench`: runs the benchmarks of hive_lab, which an installed hive may lack."""

from __future__ import annotations

import os
import shutil

import click

from fleet_manager.errors import InputError


@click.command(
    add_help_option=False,
    context_settings={"ignore_unknown_options": True, "allow_interspersed_args": False},
)
@click.argument("words", nargs=-1, type=click.UNPROCESSED)
def bench(words: tuple[str, ...]) -> None:
    """Measure the system; without a NAME, list the benchmarks."""
    program = shutil.which("rosrun")
    if program is None:
        raise InputError("rosrun was not found; run this in ./hive shell")
    os.execv(program, [program, "hive_lab", "bench", *words])  # noqa: S606  (rosrun of the sourced ROS)
