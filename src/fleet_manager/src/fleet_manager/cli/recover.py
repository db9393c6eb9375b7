# SPDX-License-Identifier: BSD-3-Clause
"""The command for a hive that does not start because of what is on its disks: `recover`."""

from __future__ import annotations

import random
from contextlib import closing
from typing import TYPE_CHECKING

import click

from blackboard.auction.decision_log import ENDING
from blackboard.consensus.journal import SqliteJournal, drop_task
from blackboard.consensus.member import is_majority, majority_of, name_of
from blackboard.consensus.recovery import newest, recover_journal, succeeds
from fleet_manager.cli.context import ask_first, journal_option, pass_context, yes_option
from fleet_manager.client.tables import aligned
from fleet_manager.errors import InputError, NotDoneError

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

    from blackboard.consensus.journal import HardState
    from fleet_manager.cli.context import CliContext

_HEAD = ("MEMBER", "HIVE", "EPOCH", "CHANGE", "TASKS", "OPEN", "MEMBERS ON ITS LIST")


@click.command()
@click.option(
    "--drop",
    "task",
    metavar="TASK",
    help="The id of the task to remove from the list of every member on this machine.",
)
@click.option(
    "--force-members",
    "left",
    metavar="MEMBER,...",
    help="The members on this machine that are left; the one with the newest list goes on alone.",
)
@yes_option
@journal_option
@pass_context
def recover(
    context: CliContext, task: str | None, left: str | None, folder: Path | None, *, yes: bool
) -> None:
    """Mend the disks of a hive that does not start because of what is on them.

    End all members on this machine before. Without an option, this lists the disks that are here.

    --drop removes a task that members cannot use. Run it on every machine that has members, before
    you start any of them again: their lists must be the same. A hive that runs removes a task with
    `hive cancel`.

    --force-members is for a hive of which half the members or more are gone for good. Compare the
    lists on all machines, and run it on one: where the list with the highest epoch is, then with
    the highest change. That member has to be able to lead (its parameter stands_by). All others
    join it by themselves, a few seconds after it was started.

    \b
    Examples:
      hive recover
      hive recover --drop T7
      hive recover --force-members robot1,robot3
    """  # noqa: D301  (to click, \b means: keep the lines)
    where = folder or context.journals()
    journals = [path for path in sorted(where.glob("*.sqlite3")) if not path.name.endswith(ENDING)]
    if task is not None and left is not None:
        raise click.UsageError("--drop and --force-members are two things; do one after the other")
    if task is not None:
        _drop(journals, task, where)
    elif left is not None:
        _force(journals, left, where, yes=yes)
    else:
        _show(journals, where)


def _drop(journals: list[Path], task: str, where: Path) -> None:
    dropped = [path.stem for path in journals if drop_task(path, task)]
    if not dropped:
        raise NotDoneError(
            f"no journal in {where} has {task}; name another folder with --journal, or run this "
            "on the machine of the member that named the task"
        )
    click.echo(f"{task} is removed from the journals of {', '.join(dropped)} in {where}")


def _show(journals: list[Path], where: Path) -> None:
    disks = _read(journals, where)
    click.echo("\n".join(aligned(_HEAD, [_row(disk) for disk in disks.values()])))
    click.echo()
    hives = {disk.hive for disk in disks.values() if disk.hive}
    for hive in sorted(hives):
        if not any(succeeds(other, hive) for other in hives):
            disk = newest(disk for disk in disks.values() if disk.hive == hive)
            click.echo(_described(disk, disks.values()))


def _force(journals: list[Path], left: str, where: Path, *, yes: bool) -> None:
    disks = _read(journals, where)
    named = [_named(word.strip(), disks, where) for word in left.split(",")]
    path, disk = _newest(named)
    others = ", ".join(_shown(each) for each in disk.log.latest.members if each != disk.member)
    if _is_majority(disk, disks.values()) and not yes:
        raise InputError(
            f"{_described(disk, disks.values())} To recover it all the same, because so many "
            "cannot run, add --yes"
        )
    told = [
        (
            f"{_shown(disk.member)} goes on alone with its own list: {_counted(disk)}. What only "
            "the others knew is lost, and has to be posted again."
        ),
    ]
    if others:
        told.append(
            f"Do this only if the other members ({others}) cannot be a majority any more. If they "
            "can, two hives give robots the same tasks."
        )
    ask_first(told, yes=yes)
    after = recover_journal(path, random.SystemRandom())
    click.echo(
        f"{_shown(after.member)} is the only member of hive {after.hive} now (before: "
        f"{disk.hive}), with {_counted(after)}. Start all members again; the others join it after "
        "some seconds. Then post again what the list lacks."
    )


def _read(journals: list[Path], where: Path) -> dict[Path, HardState]:
    """Return what is on the disks of a folder; nobody may have them open."""
    disks = {}
    for path in journals:
        with closing(SqliteJournal(path, alone=True)) as journal:
            if (known := journal.load()) is not None:
                disks[path] = known
    if not disks:
        raise InputError(
            f"no member has a journal in {where}; name another folder with --journal, or run this "
            "on a machine that has members"
        )
    return disks


def _named(word: str, disks: dict[Path, HardState], where: Path) -> tuple[Path, HardState]:
    """Return the journal of a member and what is in it.

    Raises:
        InputError: No journal or several belong to that name, or it belongs to no hive.
    """
    found = [each for each in disks.items() if word in _spellings(each[1].member)]
    if len(found) != 1:
        here = ", ".join(_shown(disk.member) for disk in disks.values())
        count = "no journal" if not found else f"more than one journal ({len(found)})"
        raise InputError(
            f"{count} in {where} belongs to {word!r}; allowed: {here}. Members on other machines "
            "join by themselves"
        )
    if not found[0][1].hive:
        raise InputError(
            f"{word} belongs to no hive, so there is nothing to recover; leave it out"
        )
    return found[0]


def _newest(named: list[tuple[Path, HardState]]) -> tuple[Path, HardState]:
    """Return the journal that lacks the least.

    Raises:
        InputError: The journals are those of several hives.
    """
    best = newest([disk for _, disk in named])
    for _, disk in named:
        if disk.hive != best.hive and not succeeds(best.hive, disk.hive):
            raise InputError(
                f"{_shown(best.member)} belongs to hive {best.hive}, and {_shown(disk.member)} to "
                f"hive {disk.hive}; name members of one hive"
            )
    return next(each for each in named if each[1] is best)


def _described(disk: HardState, here: Collection[HardState]) -> str:
    """Return how many of a hive's members have their journals here, and what that means."""
    listed, found = disk.log.latest.members, {each.member for each in here}
    begin = (
        f"Journals here: {sum(each in found for each in listed)} of the {len(listed)} on "
        f"{_shown(disk.member)}'s list of hive {disk.hive}."
    )
    if _is_majority(disk, here):
        return f"{begin} That is a majority: start them, and the hive goes on as it is."
    return (
        f"{begin} The hive decides nothing before {majority_of(listed)} of them run; if so many "
        "never will: hive recover --force-members MEMBER,..."
    )


def _is_majority(disk: HardState, here: Collection[HardState]) -> bool:
    return is_majority((each.member for each in here), disk.log.latest.members)


def _row(disk: HardState) -> tuple[str, ...]:
    log = disk.log
    return (
        _shown(disk.member),
        disk.hive or "none",
        str(log.position.epoch),
        str(log.position.version),
        str(len(log.latest.records)),
        str(_open(disk)),
        ", ".join(map(_shown, log.latest.members)) or "nobody",
    )


def _open(disk: HardState) -> int:
    records = disk.log.latest.records.values()
    return sum(not record.state.is_terminal for record in records)


def _counted(disk: HardState) -> str:
    count = len(disk.log.latest.records)
    return f"{count} {'task' if count == 1 else 'tasks'}, {_open(disk)} of them open"


def _shown(member_id: str) -> str:
    """Return the name of a robot for its member's id, and for others the member's name."""
    return name_of(member_id).strip("/").removesuffix("/robot")


def _spellings(member_id: str) -> set[str]:
    """Return the texts that mean a member."""
    name, shown = name_of(member_id), _shown(member_id)
    return {member_id, name, name.strip("/"), shown, shown.rpartition("/")[2]}
