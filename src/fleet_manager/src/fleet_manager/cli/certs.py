# SPDX-License-Identifier: BSD-3-Clause
"""The command `certs`: who may take part in a hive over Zenoh, and as what."""

from __future__ import annotations

import os
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING

import click

from blackboard.zenoh.access import Role
from fleet_manager.certs.issuing import today
from fleet_manager.certs.site import AUTHORITY_DAYS, MEMBER_DAYS, Site
from fleet_manager.cli.context import ask_first, yes_option
from fleet_manager.client.tables import aligned
from fleet_manager.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable

    from fleet_manager.certs.issuing import Issued

_SOON = timedelta(days=30)
"""A certificate that ends within this time is to be renewed."""

_HEAD = ("NAME", "ROLE", "VALID UNTIL", "")

_MOST_DAYS = 3650


def _default_folder() -> Path:
    """Return the folder of all sites of this user."""
    config = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(config) / "robo-hive" / "sites"


def _options(function: Callable[..., None]) -> Callable[..., None]:
    """Add the options that say which site is meant."""
    for option in (
        click.option("--site", metavar="SITE", help="Which site, where there are several."),
        _folder_option,
    ):
        function = option(function)
    return function


_folder_option = click.option(
    "--folder",
    type=click.Path(file_okay=False, path_type=Path),
    help="The folder of all sites.  [default: ~/.config/robo-hive/sites]",
)


def _days_option(default: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    return click.option(
        "--days",
        type=click.IntRange(1, _MOST_DAYS),
        default=default,
        show_default=True,
        help="How long it is valid.",
    )


@click.group()
def certs() -> None:
    """Make, renew and revoke certificates: who may take part in a hive of several machines.

    A site has an authority of its own. It issues a certificate to each robot, operator, viewer and
    router, for one role. The roles decide what each may say: a robot only what is its own, an
    operator posts and cancels tasks, a viewer only listens. See docs/security.md.

    \b
    Examples:
      hive certs new lab
      hive certs add robot2 --role robot
      hive certs add laptop1 --role operator
      hive certs list
      hive certs revoke robot2
    """  # noqa: D301  (to click, \b means: keep the lines)


@certs.command()
@click.argument("site")
@_days_option(AUTHORITY_DAYS)
@_folder_option
def new(site: str, days: int, folder: Path | None) -> None:
    """Make the authority of SITE, which issues all its certificates."""
    made = Site.new((folder or _default_folder()) / site, days)
    click.echo(
        f"{made.name} has an authority until {made.until:%Y-%m-%d}, in {made.folder}. Whoever has "
        "authority.key decides who takes part: keep it on this machine, and keep a copy in a safe "
        "place."
    )


@certs.command()
@click.argument("name")
@click.option(
    "--role",
    type=click.Choice([each.value for each in Role]),
    required=True,
    help="What it may do; a learner is a robot that may not lead.",
)
@_days_option(MEMBER_DAYS)
@_options
def add(name: str, role: str, days: int, site: str | None, folder: Path | None) -> None:
    """Issue a certificate to NAME: the name of a robot, of a computer or of a person."""
    known = _site(site, folder)
    issued = known.add(name, Role(role), days)
    click.echo(f"{name} is {_article(role)} of {known.name} until {issued.until:%Y-%m-%d}.")
    _say_what_to_copy(known, name)
    _say_who_has_to_know(known, issued, "lets it in")


@certs.command()
@click.argument("name")
@_days_option(MEMBER_DAYS)
@_options
def renew(name: str, days: int, site: str | None, folder: Path | None) -> None:
    """Issue another certificate to NAME; the one before stays valid until it ends."""
    known = _site(site, folder)
    issued = known.renew(name, days)
    click.echo(f"{name} has a new certificate until {issued.until:%Y-%m-%d}.")
    _say_what_to_copy(known, name)


@certs.command()
@click.argument("name")
@yes_option
@_options
def revoke(name: str, site: str | None, folder: Path | None, *, yes: bool) -> None:
    """Take NAME off the access list; its certificate is worth nothing then."""
    known = _site(site, folder)
    issued = known.known(name)
    ask_first([f"{name} can take part no more, and its files here are deleted."], yes=yes)
    known.revoke(name)
    click.echo(f"{name} is off the access list.")
    _say_who_has_to_know(known, issued, "keeps it out")


@certs.command("list")
@_options
def list_(site: str | None, folder: Path | None) -> None:
    """Show who has a certificate, as what and until when."""
    known = _site(site, folder)
    rows = [
        (each.name, each.role.value, f"{each.until:%Y-%m-%d}", _what_to_do(each))
        for each in known.issued().values()
    ]
    click.echo("\n".join(aligned(_HEAD, rows)))
    click.echo(f"\nThe authority of {known.name} ends on {known.until:%Y-%m-%d}.")


def _site(name: str | None, folder: Path | None) -> Site:
    """Open a site: the one of that name, or the only one.

    Raises:
        InputError: There is none, or there are several and none is named.
    """
    where = folder or _default_folder()
    if name is not None:
        return Site(where / name)
    found = sorted(path for path in where.glob("*") if path.is_dir())
    if not found:
        raise InputError(f"there is no site in {where}; make one: hive certs new SITE")
    if len(found) > 1:
        names = ", ".join(path.name for path in found)
        raise InputError(f"there are several sites in {where}: {names}; name one with --site")
    return Site(found[0])


def _say_what_to_copy(site: Site, name: str) -> None:
    click.echo(
        f"Copy the folder {site.folder_of(name)} to the machine of {name}, and let nobody else "
        "read own.key there."
    )


def _say_who_has_to_know(site: Site, issued: Issued, what: str) -> None:
    """Say whose access list has to be new: with routers, everyone connects to them alone."""
    all_others = [each for each in site.issued().values() if each.name != issued.name]
    routers = [each for each in all_others if each.role is Role.ROUTER]
    chosen = all_others if issued.role is Role.ROUTER or not routers else routers
    others = ", ".join(each.name for each in chosen)
    if others:
        which = "router" if chosen is routers else "other machine"
        click.echo(
            f"Each {which} {what} once it has the new access.json from its own folder in "
            f"{site.folder / 'members'} and was started again: {others}."
        )


def _what_to_do(issued: Issued) -> str:
    now = today()
    if not issued.is_valid(now):
        return f"ended: hive certs renew {issued.name}"
    if issued.until - now < _SOON:
        return f"ends in {(issued.until - now).days} days: hive certs renew {issued.name}"
    return ""


def _article(role: str) -> str:
    return f"an {role}" if role[0] in "aeiou" else f"a {role}"
