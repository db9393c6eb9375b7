# SPDX-License-Identifier: BSD-3-Clause
"""The front door `./hive`, its lists, and what must hold in every file of the repository."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def hive(*words, **environment):
    """Run ./hive with words that need no set-up."""
    return subprocess.run(
        [ROOT / "hive", *words],
        env=os.environ | environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def words_of_the_script():
    """Return the words that the script does not pass on to the command line."""
    script = (ROOT / "hive").read_text()
    cases = re.search(r"^case \${1:-help} in\n(.*)^esac", script, re.DOTALL | re.MULTILINE)[1]
    return set(re.findall(r"^  ([a-z]+)(?: \|[^)]*)?\)", cases, re.MULTILINE))


def tracked_text_files():
    """Return every text file that git knows, or would know if it were added."""
    listed = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    files = [ROOT / name for name in listed.stdout.split("\0") if name]
    return [file for file in files if file.is_file() and b"\0" not in file.read_bytes()]


@pytest.mark.parametrize("word", ["help", "--help", "-h", ""])
def test_help_names_every_word_that_hive_handles_itself(word):
    shown = hive(*word.split())
    own = shown.stdout.partition("Any other word")[0]
    explained = set(re.findall(r"^  ([a-z]+) ", own, re.MULTILINE))

    assert shown.returncode == 0
    assert explained == {"setup", "demo", "test", "bench", "shell", "help"}
    assert explained - {"demo"} == words_of_the_script()


def test_help_names_every_word_of_the_command_line():
    commands = pytest.importorskip("fleet_manager.cli.main").hive.list_commands(None)
    shown = hive("help").stdout
    missing = [word for word in commands if not re.search(rf"\b{word}\b", shown)]

    assert missing == []


def test_help_names_every_test_level():
    script = (ROOT / "hive").read_text()
    levels = re.search(r"levels=\((\w+ [\w ]+)\)", script)[1].split()
    named = re.search(r"run the tests: ([a-z, ]+), or all", hive("help").stdout)[1].split(", ")

    assert named == ["unit", "hive", "rostest", "gui"]
    assert set(levels) == set(named)


@pytest.fixture
def hive_test(tmp_path):
    """Return a function that does `./hive test` with some program in place of Python."""
    for name in ("src/a/test", "test/unit", "test/hive", "test/rostest", "test/gui"):
        (tmp_path / name).mkdir(parents=True)
    (tmp_path / "src/a/test/test_a.py").touch()
    python = tmp_path / ".venv/bin/python"
    python.parent.mkdir(parents=True)
    python.touch(mode=0o755)
    script = (ROOT / "hive").read_text()
    functions = script[script.index("level_folders() {") : script.index("# Tab completion")]
    stubs = 'die() { echo "$*" >&2; exit 1; }; own_master() { :; }; enter() { :; }'
    program = f'root=$PWD; {stubs}\n{functions}\nrun_tests "$@"'

    def run(stand_in, *words):
        python.write_text(f"#!/bin/bash\n{stand_in}\n")
        return subprocess.run(
            ["bash", "-euc", program, "-", *words],
            cwd=tmp_path,
            env={name: value for name, value in os.environ.items() if name != "PYTHONWARNINGS"},
            capture_output=True,
            text=True,
            check=False,
        )

    return run


@pytest.fixture
def chosen(tmp_path, hive_test):
    """Return a function that tells which words `./hive test` gives to pytest."""

    def words_for(*words):
        done = hive_test("printf '%s\\n' \"$@\"", *words)
        told = done.stdout.replace(f"{tmp_path}/", "").splitlines()
        return told[told.index("pythonpath=") + 1 :] if told else done.stderr.strip()

    return words_for


ALL = ["test/rostest", "test/gui", "test/hive", "src/a/test", "test/unit"]


@pytest.mark.parametrize(
    ("words", "folders", "rest"),
    [
        ([], ALL, []),
        (["-q"], ALL, ["-q"]),
        (["-k", "test"], ALL, ["-k", "test"]),
        (["--junitxml", "src/a/test/test_a.py"], ALL, ["--junitxml", "src/a/test/test_a.py"]),
        (["hive", "unit", "-x"], ["test/hive", "src/a/test", "test/unit"], ["-x"]),
        (["quick"], ["src/a/test", "test/unit", "test/hive"], ["-m", "not slow"]),
        (["quick", "-x"], ["src/a/test", "test/unit", "test/hive"], ["-m", "not slow", "-x"]),
    ],
)
def test_whole_levels_run_in_several_workers_with_a_second_look(chosen, words, folders, rest):
    told = chosen(*words)

    assert told[0] == "-n"
    assert told[2:6] == ["--dist", "loadgroup", "-p", "hive_lab.runner.plugin"]
    assert told[6:] == ["--second-look", *folders, *rest]


@pytest.mark.parametrize(
    "words",
    [
        ["src/a/test/test_a.py"],
        ["-q", "src/a/test/test_a.py"],
        ["-k", "a", "src/a/test/test_a.py::test_one"],
        ["test/rostest", "-x"],
    ],
)
def test_a_path_runs_alone_wherever_it_stands(chosen, words):
    assert chosen(*words) == words


@pytest.mark.parametrize(
    ("calculation", "works"), [("a - a", False), ("a + a", True), ("b / 0", True)]
)
def test_a_calculation_without_a_result_ends_the_programs_that_tests_start(
    hive_test, calculation, works
):
    numbers = "a, b = np.array([np.inf]), np.array([1.0])"
    program = f"import numpy as np; {numbers}; {calculation}"

    done = hive_test(f'exec {sys.executable} -c "{program}"')

    assert (done.returncode == 0) == works, done.stderr


def test_a_word_that_is_neither_a_level_nor_a_path_is_named(chosen):
    assert "no test level or file is called 'untit'" in chosen("untit")


def test_bash_completes_every_word_that_there_is():
    commands = pytest.importorskip("fleet_manager.cli.main").hive.list_commands(None)
    words = re.search(r"^# words: (.*)$", (ROOT / "hive").read_text(), re.MULTILINE)[1].split()

    assert len(words) == len(set(words))
    assert set(words) == {*commands, *words_of_the_script()}


def completed(*words):
    """Return what bash completes the last word to."""
    script = """
        source setup/completion.bash
        COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
        _hive_complete
        printf '%s\n' "${COMPREPLY[@]}"
    """
    found = subprocess.run(
        ["bash", "-c", script, "-", *words], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return found.stdout.split()


@pytest.mark.parametrize(
    ("words", "candidates"),
    [
        (["./hive", "ta"], ["tasks"]),
        (["hive", "rep"], ["replay"]),
        (["hive", "sh"], []),
        (["./hive", "test", "g"], ["gui"]),
        (["./hive", "setup", ""], []),
    ],
)
def test_bash_completes_the_words_of_the_front_door(words, candidates):
    assert completed(*words) == candidates


@pytest.mark.skipif(not (ROOT / "devel/environment.bash").is_file(), reason="needs ./hive setup")
@pytest.mark.parametrize(
    ("words", "candidates"),
    [
        (["./hive", "tasks", "--a"], ["--all"]),
        (["./hive", "add", "GP"], ["GPA", "GPAB"]),
        (["./hive", "run", "sm"], ["smoke"]),
        (["./hive", "demo", "--fleet", "w"], ["warehouse"]),
        (["./hive", "fault", "fr"], ["freeze"]),
        (["./hive", "bench", "al"], ["allocation"]),
    ],
)
def test_bash_completes_what_the_command_line_knows(words, candidates):
    assert completed(*words) == candidates


@pytest.fixture
def clone(tmp_path):
    """A clone that is set up, and nothing in it has changed since."""
    root = tmp_path / "clone"
    for name in (
        "setup/apt-packages.txt", "setup/pip-packages.txt", ".venv/bin/python", ".venv/stamp",
        ".venv/loops-stamp", "devel/stamp", "devel/setup.bash", "devel/environment.bash",
        "src/a/CMakeLists.txt", "src/a/package.xml", "src/a/msg/A.msg", "src/a/src/a/loops.py",
        "src/a/README.md", ".hive/ready",
    ):  # fmt: skip
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).touch(mode=0o777)
    ready = root / ".hive/ready"
    ready.write_text(f"{root}\n")
    now = max(file.stat().st_ctime_ns for file in root.rglob("*"))
    os.utime(ready, ns=(now, now))
    probe = tmp_path / "probe"
    probe.touch()
    while probe.stat().st_ctime_ns <= now:  # the file system's clock ticks every few milliseconds
        probe.touch()
    return root


def is_ready(clone):
    """Return whether `./hive` takes a clone for ready at once."""
    words = 'root=$1; source "$2/setup/install.bash"; is_ready'
    return not subprocess.run(["bash", "-c", words, "-", clone, ROOT], check=False).returncode


@pytest.mark.parametrize("change", ["true", "touch src/a/README.md"])
def test_a_clone_in_which_nothing_changed_that_matters_is_ready(clone, change):
    subprocess.run(["bash", "-c", change], cwd=clone, check=True)

    assert is_ready(clone)


@pytest.mark.parametrize(
    "change",
    [
        "touch setup/apt-packages.txt",
        "touch setup/pip-packages.txt",
        "touch src/a/CMakeLists.txt",
        "touch src/a/package.xml",
        "touch -d 2000-01-01 src/a/msg/A.msg",
        "rm src/a/msg/A.msg",
        "touch src/a/src/a/loops.py",
        "rm -r .venv",
        "rm .venv/loops-stamp",
        "rm -r devel",
        "rm .hive/ready",
        "echo /elsewhere >.hive/ready",
        "touch -d 2000-01-01 .hive/ready",  # Debian's list of packages is newer
    ],
)
def test_set_up_is_looked_at_again_after_a_change(clone, change):
    subprocess.run(["bash", "-c", change], cwd=clone, check=True)

    assert not is_ready(clone)


@pytest.mark.skipif(not (ROOT / "devel/environment.bash").is_file(), reason="needs ./hive setup")
def test_workspaces_that_are_named_are_laid_over_the_hives_and_a_missing_one_is_said(tmp_path):
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "setup.bash").write_text(
            f'false; echo "{name} $1 ${{UNSET_VARIABLE}} on ${{CMAKE_PREFIX_PATH##*/}}"\n'
        )
    overlays = f"{tmp_path}/first:{tmp_path}/nothing:{tmp_path}/second"
    done = subprocess.run(
        ["bash", "-euc", f"source {ROOT}/setup/environment.bash; echo $-"],
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "HIVE_OVERLAYS": overlays},
        capture_output=True,
        text=True,
        check=True,
    )

    *laid, options = done.stdout.splitlines()
    assert laid == ["first --extend  on devel", "second --extend  on devel"]
    assert {"e", "u"} <= set(options)
    assert done.stderr.count("\n") == 1
    assert f"HIVE_OVERLAYS names {tmp_path}/nothing, which holds no setup.bash" in done.stderr


@pytest.mark.parametrize(
    "name",
    sorted(path.name for path in (ROOT / "src/hive_navigation/nodes").iterdir() if path.is_file()),
)
def test_a_program_under_its_old_name_starts_with_a_warning(name, tmp_path):
    rosrun = tmp_path / "rosrun"
    rosrun.write_text('#!/bin/sh\nprintf "%s\\n" "$@"\n')
    rosrun.chmod(0o755)
    done = subprocess.run(
        [ROOT / "setup/old_names/robot_navigation" / name, "a word", "__name:=other"],
        env={"PATH": f"{tmp_path}:/usr/bin:/bin"},
        capture_output=True,
        text=True,
        check=True,
    )

    assert done.stdout.splitlines() == ["hive_navigation", name, "a word", "__name:=other"]
    assert f"'rosrun hive_navigation {name}'" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.skipif(not (ROOT / "devel/environment.bash").is_file(), reason="needs ./hive setup")
def test_the_old_name_of_a_package_gives_way_to_a_released_package_of_that_name(tmp_path):
    overlay = tmp_path / "devel"
    overlay.mkdir()
    (overlay / "setup.bash").write_text(f'ROS_PACKAGE_PATH="{overlay}:$ROS_PACKAGE_PATH"\n')
    done = subprocess.run(
        ["bash", "-euc", f"source {ROOT}/setup/environment.bash; echo $ROS_PACKAGE_PATH"],
        env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path), "HIVE_OVERLAYS": str(overlay)},
        capture_output=True,
        text=True,
        check=True,
    )

    first, *_, last = done.stdout.strip().split(":")
    assert first == str(overlay)
    assert last == f"{ROOT}/setup/old_names"


def installed_on(tmp_path, programs):
    """Install Debian packages where none is, with programs in bash; return what is said."""
    (tmp_path / "setup").mkdir()
    (tmp_path / ".hive").mkdir()
    (tmp_path / "setup/apt-packages.txt").write_text("make\npython3-rospy\nrviz\n")
    script = f"""
        root=$1; source "$2/setup/install.bash"
        release() {{ echo 'Plan 9'; }}
        dpkg-query() {{ :; }}
        administer() {{ "$@"; }}
        find_administrator() {{ :; }}
        {programs}
        install_packages
    """
    words = ["bash", "-uo", "pipefail", "-c", script, "-", tmp_path, ROOT]
    return subprocess.run(words, capture_output=True, text=True, check=False)


def test_setup_names_the_release_and_the_packages_that_it_does_not_have(tmp_path):
    said = installed_on(
        tmp_path,
        """
        apt-get() { return 100; }
        apt-cache() { [[ ${*: -1} == make ]]; }
        """,
    )

    assert said.returncode == 1
    assert "this is Plan 9, and its package sources lack: python3-rospy rviz." in said.stderr
    assert "Ubuntu 22.04 and 24.04" in said.stderr


def test_setup_names_the_release_and_what_apt_said_where_all_packages_are_known(tmp_path):
    said = installed_on(
        tmp_path,
        """
        apt-get() { echo 'E: no space left'; return 100; }
        apt-cache() { :; }
        """,
    )

    assert said.returncode == 1
    assert "apt-get failed on Plan 9: E: no space left" in said.stderr


def test_setup_names_the_release_where_there_is_no_apt(tmp_path):
    said = installed_on(tmp_path, "command() { [[ $2 != apt-get ]]; }")

    assert said.returncode == 1
    assert "this is Plan 9, which has no apt-get" in said.stderr
    assert "make python3-rospy rviz" in said.stderr


def test_setup_goes_on_with_any_release_that_has_the_packages(tmp_path):
    said = installed_on(tmp_path, "apt-get() { :; }")

    assert said.returncode == 0
    assert "done in" in said.stderr


def test_setup_with_arguments_is_refused_in_one_line():
    refused = hive("setup", "everything")

    assert refused.returncode == 1
    assert refused.stderr == "hive: setup takes no arguments, and was given: everything\n"


def test_ci_runs_the_same_test_command_as_people():
    assert "exec ./hive test" in (ROOT / ".ci/run").read_text()


def test_every_wheel_is_pinned():
    lines = (ROOT / "setup/pip-packages.txt").read_text().splitlines()
    wheels = [line.partition("#")[0].strip() for line in lines]

    assert [
        wheel for wheel in wheels if wheel and not re.fullmatch(r"[\w-]+==[\d.]+", wheel)
    ] == []


def test_every_debian_package_stands_on_a_line_of_its_own_and_only_once():
    lines = (ROOT / "setup/apt-packages.txt").read_text().splitlines()
    packages = [line for line in lines if line and not line.startswith("#")]

    assert [name for name in packages if not re.fullmatch(r"[a-z0-9][a-z0-9.+-]+", name)] == []
    assert len(packages) == len(set(packages))


def test_no_file_names_a_place_on_one_machine():
    home = re.compile(r"(?<![\w.$}])/(?:home|root|Users)/\w")
    here = f"{ROOT.parent}/"
    if len(ROOT.parent.parts) <= 2:
        here = f"{ROOT}/"
    found = [
        f"{file.relative_to(ROOT)}:{number}"
        for file in tracked_text_files()
        for number, line in enumerate(file.read_text(errors="replace").splitlines(), 1)
        if home.search(line) or here in line
    ]

    assert found == []


def test_every_source_file_names_its_licence():
    heads = {
        file.relative_to(ROOT): file.read_text().splitlines()[:2]
        for file in tracked_text_files()
        if file.suffix in {".py", ".bash", ".bashrc"} or file.stat().st_mode & 0o111
        if file.name != "__init__.py"
    }
    licence = "# SPDX-License-Identifier: BSD-3-Clause"
    unnamed = [str(name) for name, head in heads.items() if licence not in head]

    assert unnamed == []
