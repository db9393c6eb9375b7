# SPDX-License-Identifier: BSD-3-Clause
"""The folder of a site: its authority, a folder for each member, and what was revoked.

| file | what |
|---|---|
| `authority.crt`, `authority.key` | who issues certificates; the key stays on this machine |
| `issued/*.crt` | the newest certificate of each member |
| `revoked/*.crt` | those of members that were revoked |
| `members/NAME/` | what the machine of a member needs, to be copied as a whole |

The access list, `access.json`, is the same in all folders of members, and is written anew with
every change.
"""

from __future__ import annotations

import json
import os
import re
import shutil
from typing import TYPE_CHECKING

from blackboard.zenoh.access import Identity, access_control
from blackboard.zenoh.session import ACCESS, ACCESS_FORMAT, AUTHORITY, CERTIFICATE, KEY, OWN
from fleet_manager.certs.issuing import (
    issue,
    new_authority,
    new_common_name,
    read_authority,
    read_issued,
    today,
)
from fleet_manager.errors import InputError, NotDoneError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from datetime import datetime
    from pathlib import Path

    from blackboard.zenoh.access import Role
    from fleet_manager.certs.issuing import Issued, Pair

AUTHORITY_DAYS = 3650
"""How long a site's authority is valid by default [days]."""

MEMBER_DAYS = 365
"""How long a member's certificate is valid by default [days]."""

_AUTHORITY_KEY = "authority.key"
_MEMBERS, _ISSUED, _REVOKED = "members", "issued", "revoked"

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]{0,47}")
"""What can be one part of a key, and with the letters that follow a common name of X.509."""

_PRIVATE, _PUBLIC, _FOLDER = 0o600, 0o644, 0o700


class Site:
    """Issues, renews and revokes the certificates of a site.

    Args:
        folder: Where it keeps them.
        now: Returns the time.

    Raises:
        InputError: The folder is not one that `new` has made, or its authority has ended.
    """

    def __init__(self, folder: Path, now: Callable[[], datetime] = today) -> None:
        self.folder = folder
        self._now = now
        if not (folder / AUTHORITY).exists():
            raise InputError(
                f"there is no site in {folder}; make one with `hive certs new {folder.name}`"
            )
        self._authority = read_authority(folder / AUTHORITY, folder / _AUTHORITY_KEY)

    @classmethod
    def new(
        cls, folder: Path, days: int = AUTHORITY_DAYS, now: Callable[[], datetime] = today
    ) -> Site:
        """Make a site with an authority of its own, named after its folder.

        Raises:
            InputError: The name is not allowed, or the folder cannot be made.
            NotDoneError: The folder is there already.
        """
        name = checked(folder.name)
        if folder.exists():
            raise NotDoneError(
                f"{folder} is there already; to begin anew, move it away. Whoever got a "
                "certificate from the old authority then needs a new one"
            )
        try:
            for each in (folder, *(folder / part for part in (_MEMBERS, _ISSUED, _REVOKED))):
                each.mkdir(_FOLDER, parents=True)
            made = new_authority(name, days, now())
            _write(folder / _AUTHORITY_KEY, made.key, _PRIVATE)
            _write(folder / AUTHORITY, made.certificate, _PUBLIC)
        except OSError as error:
            raise InputError(f"{folder} cannot be made: {error.strerror}") from None
        return cls(folder, now)

    @property
    def name(self) -> str:
        """The name of the site, and of its hive in keys."""
        return self._authority.site

    @property
    def until(self) -> datetime:
        """When its authority ends."""
        return self._authority.until

    def issued(self) -> dict[str, Issued]:
        """Return the newest certificate of each member that was not revoked, by its name."""
        found = map(read_issued, sorted((self.folder / _ISSUED).glob("*.crt")))
        return {each.name: each for each in found}

    def folder_of(self, name: str) -> Path:
        """Return the folder with what a member's machine needs."""
        return self.folder / _MEMBERS / name

    def add(self, name: str, role: Role, days: int = MEMBER_DAYS) -> Issued:
        """Issue the first certificate of a member, and write the access list anew.

        Raises:
            InputError: The name is not allowed.
            NotDoneError: There is a member of that name, or the authority has ended.
        """
        if known := self.issued().get(checked(name)):
            raise NotDoneError(
                f"{name} has a certificate as {known.role.value}; to replace it, run `hive certs "
                f"renew {name}`, to give it another role, revoke it first"
            )
        issued = self._issue(new_common_name(name), role, days)
        self._write_access()
        return issued

    def renew(self, name: str, days: int = MEMBER_DAYS) -> Issued:
        """Issue another certificate to a member; the one before stays valid until it ends.

        Raises:
            NotDoneError: There is no such member, or the authority has ended.
        """
        known = self.known(name)
        issued = self._issue(known.common_name, known.role, days)
        self._write_access()
        return issued

    def revoke(self, name: str) -> Issued:
        """Take a member off the access list, and delete its folder.

        Raises:
            NotDoneError: There is no such member.
        """
        known = self.known(name)
        file = f"{known.common_name}.crt"
        (self.folder / _ISSUED / file).replace(self.folder / _REVOKED / file)
        shutil.rmtree(self.folder_of(name), ignore_errors=True)
        self._write_access()
        return known

    def known(self, name: str) -> Issued:
        """Return the newest certificate of a member.

        Raises:
            NotDoneError: There is no such member.
        """
        members = self.issued()
        if name not in members:
            listed = ", ".join(members) or "nobody yet"
            raise NotDoneError(f"{name} has no certificate of {self.name}; it has: {listed}")
        return members[name]

    def access(self) -> Mapping[str, object]:
        """Return the access list: all members that were not revoked."""
        known = self.issued().values()
        identities = [Identity(each.name, each.role, each.common_name) for each in known]
        return access_control(self.name, identities)

    def _issue(self, common_name: str, role: Role, days: int) -> Issued:
        now = self._now()
        if now >= self.until:
            raise NotDoneError(
                f"the authority of {self.name} has ended on {self.until:%Y-%m-%d}; make a new "
                "site, and give every member a new certificate"
            )
        made = issue(self._authority, common_name, role, days, now)
        path = self.folder / _ISSUED / f"{common_name}.crt"
        _write(path, made.certificate, _PUBLIC)
        issued = read_issued(path)
        self._hand_out(issued.name, made)
        return issued

    def _hand_out(self, name: str, made: Pair) -> None:
        """Put a certificate and its key into the member's folder, both or neither."""
        folder = self.folder_of(name)
        new, old = (folder.with_name(f".{name}.{which}") for which in ("new", "old"))
        for each in (new, old):
            shutil.rmtree(each, ignore_errors=True)
        new.mkdir(_FOLDER)
        _write(new / KEY, made.key, _PRIVATE)
        _write(new / CERTIFICATE, made.certificate, _PUBLIC)
        _write(new / AUTHORITY, (self.folder / AUTHORITY).read_bytes(), _PUBLIC)
        _write(new / OWN, json.dumps({"hive": self.name, "name": name}).encode(), _PUBLIC)
        if folder.exists():
            folder.rename(old)
        new.rename(folder)
        shutil.rmtree(old, ignore_errors=True)

    def _write_access(self) -> None:
        content = {"format": ACCESS_FORMAT, "access_control": self.access()}
        text = json.dumps(content, indent=1).encode()
        for name in self.issued():
            if self.folder_of(name).is_dir():
                _write(self.folder_of(name) / ACCESS, text, _PUBLIC)


def checked(name: str) -> str:
    """Return a name that can be part of a key.

    Raises:
        InputError: It cannot.
    """
    if not _NAME.fullmatch(name):
        raise InputError(
            f"the name {name[:64]!r} is not allowed; allowed: a letter, then up to 47 letters, "
            "digits, '_' and '-'"
        )
    return name


def _write(path: Path, text: bytes, mode: int) -> None:
    """Write a file whole or not at all; nobody else ever sees what is private."""
    passing = path.with_name(f"{path.name}.part")
    passing.unlink(missing_ok=True)
    descriptor = os.open(passing, os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode)
    with os.fdopen(descriptor, "wb") as file:
        file.write(text)
        os.fchmod(file.fileno(), mode)
        file.flush()
        os.fsync(file.fileno())
    passing.replace(path)
