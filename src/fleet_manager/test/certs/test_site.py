# SPDX-License-Identifier: BSD-3-Clause
"""The certificates of a site: issued, renewed, revoked, and the files that hold them."""

import json
from datetime import datetime, timedelta, timezone

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.serialization import load_pem_private_key

from blackboard.zenoh.access import Role
from fleet_manager.certs.site import Site
from fleet_manager.errors import InputError, NotDoneError

TODAY = datetime(2026, 11, 27, 12, tzinfo=timezone.utc)
DAY = timedelta(days=1)


class Calendar:
    """A date that a test sets."""

    def __init__(self):
        self.now = TODAY

    def __call__(self):
        return self.now


@pytest.fixture
def calendar():
    return Calendar()


@pytest.fixture
def site(tmp_path, calendar):
    return Site.new(tmp_path / "lab", now=calendar)


def certificate(folder, name="own.crt"):
    return x509.load_pem_x509_certificate((folder / name).read_bytes())


def listed(site, reader):
    """Return the common names on the access list in a member's folder, by member."""
    content = json.loads((site.folder_of(reader) / "access.json").read_text())
    section = content["access_control"]
    return {each["id"]: each["cert_common_names"] for each in section["subjects"]}


def test_a_member_gets_a_certificate_of_the_sites_authority_and_the_key_to_it(site):
    site.add("robot2", Role.ROBOT)
    folder = site.folder_of("robot2")
    own, authority = certificate(folder), certificate(folder, "authority.crt")
    key = load_pem_private_key((folder / "own.key").read_bytes(), None)

    own.verify_directly_issued_by(authority)
    assert own.public_key() == key.public_key()
    assert isinstance(key, ec.EllipticCurvePrivateKey)
    assert not own.extensions.get_extension_for_class(x509.BasicConstraints).value.ca


def test_an_authority_can_issue_certificates_but_no_other_authorities(site):
    limits = certificate(site.folder, "authority.crt").extensions.get_extension_for_class(
        x509.BasicConstraints
    )

    assert limits.critical
    assert (limits.value.ca, limits.value.path_length) == (True, 0)


def test_only_this_user_reads_keys(site):
    site.add("robot2", Role.ROBOT)
    files = {path.name: path.stat().st_mode & 0o777 for path in site.folder.rglob("*.key")}
    folders = {path.stat().st_mode & 0o777 for path in site.folder.rglob("*") if path.is_dir()}

    assert files == {"authority.key": 0o600, "own.key": 0o600}
    assert folders | {site.folder.stat().st_mode & 0o777} == {0o700}


def test_a_certificate_is_valid_from_the_day_before_for_as_many_days_as_asked(site):
    issued = site.add("robot2", Role.ROBOT, days=30)
    own = certificate(site.folder_of("robot2"))

    assert own.not_valid_before_utc == TODAY - DAY
    assert own.not_valid_after_utc == issued.until == TODAY + 30 * DAY


def test_no_certificate_outlives_its_authority(tmp_path, calendar):
    site = Site.new(tmp_path / "lab", days=100, now=calendar)

    assert site.add("robot2", Role.ROBOT, days=365).until == site.until == TODAY + 100 * DAY


def test_an_authority_that_has_ended_issues_nothing(tmp_path, calendar):
    site = Site.new(tmp_path / "lab", days=100, now=calendar)
    site.add("robot1", Role.ROBOT)
    calendar.now += 101 * DAY

    for issue in (lambda: site.add("robot2", Role.ROBOT), lambda: site.renew("robot1")):
        with pytest.raises(NotDoneError, match="has ended on 2027-03-07; make a new site"):
            issue()
    assert list(site.issued()) == ["robot1"]


def test_every_member_has_the_same_access_list_with_all_members(site):
    site.add("robot1", Role.ROBOT)
    site.add("laptop1", Role.OPERATOR)
    site.add("robot2", Role.LEARNER)

    lists = [listed(site, name) for name in ("robot1", "laptop1", "robot2")]
    assert lists[0] == lists[1] == lists[2]
    assert lists[0] == {name: [each.common_name] for name, each in site.issued().items()}


def test_a_renewed_certificate_needs_no_new_access_list(site, calendar):
    before = site.add("robot2", Role.ROBOT)
    site.add("robot1", Role.ROBOT)
    access, key = listed(site, "robot1"), (site.folder_of("robot2") / "own.key").read_bytes()
    calendar.now += 300 * DAY
    after = site.renew("robot2")

    assert listed(site, "robot1") == listed(site, "robot2") == access
    assert (after.common_name, after.role) == (before.common_name, Role.ROBOT)
    assert after.until == calendar.now + 365 * DAY
    assert certificate(site.folder_of("robot2")).not_valid_after_utc == after.until
    assert (site.folder_of("robot2") / "own.key").read_bytes() != key


def test_who_is_revoked_is_on_no_list_and_has_another_name_on_it_when_added_again(site):
    site.add("robot1", Role.ROBOT)
    revoked = site.add("robot2", Role.ROBOT)
    site.revoke("robot2")
    without = listed(site, "robot1")
    site.add("robot2", Role.ROBOT)

    assert list(without) == ["robot1"]
    assert revoked.common_name not in listed(site, "robot1")["robot2"]


def test_the_files_of_who_is_revoked_are_deleted(site):
    site.add("robot2", Role.ROBOT)
    site.revoke("robot2")

    assert not site.folder_of("robot2").exists()
    assert site.issued() == {}


def test_a_member_has_one_role_at_a_time(site):
    site.add("anna", Role.VIEWER)

    with pytest.raises(NotDoneError, match=r"certificate as viewer; .*hive certs renew anna"):
        site.add("anna", Role.OPERATOR)


@pytest.mark.parametrize("act", ["renew", "revoke"])
def test_who_has_no_certificate_is_named_with_those_who_have(site, act):
    site.add("robot1", Role.ROBOT)

    with pytest.raises(NotDoneError, match="robot9 has no certificate of lab; it has: robot1"):
        getattr(site, act)("robot9")


@pytest.mark.parametrize(
    "name", ["", "2", "a/b", "../a", "a*", "a b", "a.b", "ä", "a" * 49, "-a", "a\n"]
)
def test_a_name_that_cannot_be_part_of_a_key_is_refused(site, name):
    with pytest.raises(InputError, match="is not allowed; allowed: a letter"):
        site.add(name, Role.ROBOT)
    assert list((site.folder / "members").iterdir()) == []


def test_a_long_name_fits_into_a_certificate(site):
    assert site.add("a" * 48, Role.ROBOT).name == "a" * 48


def test_a_site_that_is_there_is_not_made_again(site):
    key = (site.folder / "authority.key").read_bytes()

    with pytest.raises(NotDoneError, match="is there already"):
        Site.new(site.folder)
    assert (site.folder / "authority.key").read_bytes() == key


def test_a_site_is_opened_again_with_all_its_members(site):
    site.add("robot1", Role.ROBOT)

    assert Site(site.folder).issued() == site.issued()
    assert Site(site.folder).name == "lab"


@pytest.mark.parametrize("broken", ["authority.crt", "authority.key", "issued/robot1.crt"])
@pytest.mark.parametrize("text", [b"", b"\xff\x00", b"-----BEGIN CERTIFICATE-----\nx\n"])
def test_a_broken_file_is_named(site, broken, text):
    issued = site.add("robot1", Role.ROBOT)
    (site.folder / broken.replace("robot1", issued.common_name)).write_bytes(text)

    with pytest.raises(InputError, match=r"(authority|robot1)[.\w]* cannot be read"):
        Site(site.folder).issued()


def test_a_certificate_of_somebody_else_among_the_issued_ones_is_named(site):
    stray = site.folder / "issued" / "stray.crt"
    stray.write_bytes((site.folder / "authority.crt").read_bytes())

    with pytest.raises(
        InputError, match=r"stray.crt was not issued by `hive certs`; move it away"
    ):
        site.issued()


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").touch()

    with pytest.raises(InputError, match=r"file/lab cannot be made: Not a directory"):
        Site.new(tmp_path / "file" / "lab")
