# SPDX-License-Identifier: BSD-3-Clause
"""Makes docs/test-plan.md from the results of a run, and from what the breaks showed.

    ./hive test rostest --results RESULTS
    ./hive shell -c "python3 test/rostest/try_breaks.py BREAKS.json"
    ./hive shell -c "python3 test/rostest/plan_page.py RESULTS BREAKS.json"

Which case it is, what the report asks and what is expected stand with each case in
`cases/plan/plan_*.py`; what was observed is in the results.
"""

import json
import sys
import xml.etree.ElementTree as ET
from datetime import datetime
from pathlib import Path

from fleet_manager.demo.machine import machine

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "breaks"))

from hive_breaks import BREAKS  # noqa: E402  (beside this script, in a folder of its own)

TEMPLATE = HERE / "plan_page.md"
PAGE = HERE.parents[1] / "docs" / "test-plan.md"
RUNS = ("plan_start", "plan_tasks", "plan_robots", "plan_failover")
"""The results in the order of the report's cases."""


def main():
    """Write the page from the folder and the file that the arguments name."""
    folder, file = map(Path, sys.argv[1:] or sys.exit(__doc__))
    breaks = json.loads(file.read_text(encoding="utf-8"))
    runs = {name: list(read(folder / f"{name}.xml", name)) for name in RUNS}
    tables = [f"## `{name}.test`\n\n" + "\n".join(table(cases)) for name, cases in runs.items()]
    tried = [row(n, f"`{b.test}`", b.what, said(breaks.get(n))) for n, b in BREAKS.items()]
    text = TEMPLATE.read_text(encoding="utf-8").format(
        **machine(),
        date=f"{datetime.now().astimezone():%Y-%m-%d}",
        seconds=sum(case["time"] for cases in runs.values() for case in cases),
        tables="\n\n".join(tables),
        breaks="\n".join(tried),
    )
    PAGE.write_text(text, encoding="utf-8")


def said(broken):
    """Return the failing assertion of a break, as code."""
    if broken is None:
        return "not tried yet"
    return f"`{broken['said']}`" if broken["said"] else "**nothing: not noticed**"


def read(path, run):
    """Yield the cases of a JUnit file that belong to the plan, those of one test put together."""
    cases = {}
    for case in ET.parse(path).iter("testcase"):  # noqa: S314  (our own results)
        found = {}
        for each in case.iter("property"):
            found.setdefault(each.get("name"), []).append(each.get("value"))
        if "case" not in found:
            continue
        name = case.get("name").partition("[")[0]
        entry = cases.setdefault(name, {"observed": [], "time": 0.0, "passed": True})
        label = found["case"][0]
        entry["case"] = f"8: {label}" if run == "plan_failover" and label != "7" else label
        entry |= {"test": name, "asks": found["asks"][0], "expected": found["expected"][0]}
        entry["file"] = found["file"][0]
        entry["observed"] += found.get("observed", ["nothing"])
        entry["time"] += float(case.get("time"))
        entry["passed"] &= case.find("failure") is None and case.find("error") is None
    yield from cases.values()


def table(cases):
    """Return the lines of a table of cases."""
    return [
        "| case | what is asked | test | expected | observed | time [s] | |",
        "|---|---|---|---|---|---|---|",
        *(
            row(
                case["case"],
                case["asks"],
                f"`{case['file']}`: `{case['test']}`",
                case["expected"],
                "; ".join(case["observed"]),
                f"{case['time']:.0f}",
                "passed" if case["passed"] else "**failed**",
            )
            for case in cases
        ),
    ]


def row(*cells):
    """Return a line of a table."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


if __name__ == "__main__":
    main()
