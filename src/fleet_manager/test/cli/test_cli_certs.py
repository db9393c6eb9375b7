# SPDX-License-Identifier: BSD-3-Clause
"""`hive certs`, as an operator types it."""

import contextlib

import pytest

from fleet_manager.cli.context import CliContext
from fleet_manager.cli.main import run


@pytest.fixture
def hive(tmp_path, monkeypatch, capsys):
    """Run the command line with a folder of sites of its own."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))

    def call(*words):
        code = run(CliContext(lambda _: contextlib.nullcontext(), lambda: tmp_path), list(words))
        out, err = capsys.readouterr()
        return code, out, err

    return call


@pytest.fixture
def lab(hive, tmp_path):
    """A site with a robot."""
    hive("certs", "new", "lab")
    hive("certs", "add", "robot1", "--role", "robot")
    return tmp_path / "robo-hive" / "sites" / "lab"


def test_a_new_site_says_where_its_key_is_and_what_that_is_worth(hive, tmp_path):
    code, out, err = hive("certs", "new", "lab")

    assert (code, err) == (0, "")
    assert str(tmp_path / "robo-hive" / "sites" / "lab") in out
    assert "Whoever has authority.key decides who takes part" in out


def test_who_is_added_is_told_what_to_copy_and_who_else_needs_a_file(hive, lab):
    code, out, _ = hive("certs", "add", "laptop1", "--role", "operator")

    assert code == 0
    assert out.startswith("laptop1 is an operator of lab until ")
    assert f"Copy the folder {lab}/members/laptop1" in out
    assert "Each other machine lets it in" in out
    assert out.endswith("was started again: robot1.\n")


@pytest.mark.usefixtures("lab")
def test_where_there_are_routers_they_alone_have_to_know_who_comes_and_goes(hive):
    _, new_router, _ = hive("certs", "add", "north", "--role", "router")
    assert "Each other machine lets it in" in new_router
    assert new_router.endswith("was started again: robot1.\n")

    for words in (("add", "robot2", "--role", "robot"), ("revoke", "robot1")):
        _, out, _ = hive("certs", *words)
        assert "Each router " in out
        assert out.endswith("was started again: north.\n")


@pytest.mark.usefixtures("lab")
def test_the_list_shows_who_has_to_be_renewed(hive):
    hive("certs", "add", "laptop1", "--role", "viewer", "--days", "3")
    _, out, _ = hive("certs", "list")
    rows = {line.split()[0]: line for line in out.splitlines() if line}

    assert "viewer" in rows["laptop1"]
    assert "days: hive certs renew laptop1" in rows["laptop1"]
    assert "renew" not in rows["robot1"]


@pytest.mark.usefixtures("lab")
def test_a_renewed_certificate_only_has_to_be_copied(hive):
    code, out, _ = hive("certs", "renew", "robot1", "--days", "500")

    assert code == 0
    assert "Copy the folder" in out
    assert "Each other machine" not in out


@pytest.mark.usefixtures("lab")
def test_who_is_revoked_is_off_the_list(hive):
    hive("certs", "add", "robot2", "--role", "learner")
    code, out, err = hive("certs", "revoke", "robot2")

    assert (code, err) == (0, "robot2 can take part no more, and its files here are deleted.\n")
    assert out.startswith("robot2 is off the access list.\nEach other machine keeps it out")
    assert "robot2" not in hive("certs", "list")[1]


@pytest.mark.usefixtures("lab")
def test_who_has_no_certificate_is_not_asked_about(hive):
    code, _, err = hive("certs", "revoke", "robot9")

    assert code == 1
    assert err == "hive: robot9 has no certificate of lab; it has: robot1\n"


@pytest.mark.usefixtures("lab")
def test_several_sites_have_to_be_told_apart(hive):
    hive("certs", "new", "hall")
    code, _, err = hive("certs", "list")

    assert code == 2
    assert "several sites" in err
    assert "hall, lab; name one with --site" in err
    assert hive("certs", "list", "--site", "lab")[0] == 0


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["list"], "there is no site in"),
        (["list", "--site", "nowhere"], "make one with `hive certs new nowhere`"),
        (["new", "a b"], "the name 'a b' is not allowed"),
        (["new", "lab", "--days", "0"], "--days"),
        (["add", "robot1"], "--role"),
        (["add", "robot1", "--role", "pilot"], "'pilot' is not one of"),
    ],
)
def test_a_mistake_is_one_line_that_says_what_to_do(hive, words, told):
    code, out, err = hive("certs", *words)

    assert (code, out) == (2, "")
    assert told in err
    assert "Traceback" not in err
