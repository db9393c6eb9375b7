# SPDX-License-Identifier: BSD-3-Clause
"""Breaks one thing after the other, and looks whether the case that tests it fails.

    ./hive shell -c "python3 test/rostest/try_breaks.py FILE [CASE ...]"

tries all breaks of `breaks/hive_breaks.py`, or those of the cases named, and writes into a JSON
file for each case what was broken and what the case said. It takes about 40 s for each of them.
Ends with 1 where a case did not notice.
"""

import json
import os
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as ET
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "breaks"))

from hive_breaks import BREAKS  # noqa: E402  (beside this script, in a folder of its own)

PATIENCE = "40"
"""A broken system does not come round, so its cases wait no longer than this [s]."""


def main():
    """Try the breaks that the arguments name; return the exit code."""
    file, *names = sys.argv[1:] or sys.exit(__doc__)
    path = Path(file)
    found = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    for name in names or BREAKS:
        found[name] = attempt(name)
        path.write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
        said = found[name]["said"] or "NOT NOTICED"
        sys.stdout.write(f"{name}: {found[name]['what']}: {said}\n")
        sys.stdout.flush()
    return int(not all(entry["said"] for entry in found.values()))


def attempt(name):
    """Run a case with its break; return what was broken and what the case said."""
    broken = BREAKS[name]
    cases = " or ".join(filter(None, [broken.test, broken.also]))
    with tempfile.TemporaryDirectory() as results:
        environment = os.environ | {
            "HIVE_BREAK": name,
            "HIVE_CASES": cases,
            "HIVE_PATIENCE": PATIENCE,
            "HIVE_BREAKS_PATH": str(HERE / "breaks"),
        }
        subprocess.run(
            [
                *(sys.executable, "-m", "pytest", "-c", str(HERE.parents[1] / "pyproject.toml")),
                *("-q", "-p", "no:cacheprovider", "-o", "pythonpath=", "--results", results),
                str(HERE / f"{broken.file}.test"),
            ],
            env=environment,
            stdout=subprocess.DEVNULL,
            check=False,
        )
        said = [text for path in Path(results).glob("*.xml") for text in failures(path, broken)]
    return {"test": broken.test, "what": broken.what, "said": "; ".join(dict.fromkeys(said))}


def failures(path, broken):
    """Return the failing assertion of each run of the case in a JUnit file."""
    for case in ET.parse(path).iter("testcase"):  # noqa: S314  (our own results)
        if case.get("name").partition("[")[0] == broken.test:
            for problem in [*case.findall("failure"), *case.findall("error")]:
                yield problem.get("message").splitlines()[0][:200]


if __name__ == "__main__":
    sys.exit(main())
