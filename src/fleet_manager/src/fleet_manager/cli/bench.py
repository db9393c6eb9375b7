# SPDX-License-Identifier: BSD-3-Clause
"""The command `bench`: hands over to the laboratory, which an installed hive may do without."""

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
    """Measure the system; without a NAME, list what can be measured."""
    program = shutil.which("rosrun")
    if program is None:
        raise InputError("rosrun is not found; run this in ./hive shell")
    os.execv(program, [program, "hive_lab", "bench", *words])  # noqa: S606  (rosrun of the sourced ROS)
