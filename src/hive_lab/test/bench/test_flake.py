# SPDX-License-Identifier: BSD-3-Clause
from hive_lab.bench.flake import CaseRun, PlanRun, cases_of, figures

JUNIT = """<testsuites><testsuite>
  <testcase name="test_good" time="1.5"/>
  <testcase name="test_bad" time="2.0"><failure message="no"/></testcase>
  <testcase name="test_worse" time="0.5"><error message="no"/></testcase>
</testsuite></testsuites>"""


def test_the_cases_of_a_junit_file_are_read_with_time_and_verdict(tmp_path):
    file = tmp_path / "plan_tasks.xml"
    file.write_text(JUNIT)

    assert cases_of(file) == [
        CaseRun("plan_tasks: test_good", passed=True, time=1.5),
        CaseRun("plan_tasks: test_bad", passed=False, time=2.0),
        CaseRun("plan_tasks: test_worse", passed=False, time=0.5),
    ]


def test_passes_failures_and_times_are_counted_for_each_case_over_all_runs():
    first = (CaseRun("drive", passed=True, time=1.0), CaseRun("pick", passed=True, time=5.0))
    second = (CaseRun("drive", passed=True, time=3.0), CaseRun("pick", passed=False, time=9.0))

    found = figures([PlanRun(first, time=16.0), PlanRun(second, time=20.0)])

    assert (found["runs"], found["failures"]) == (2, 1)
    assert (found["a run median"], found["a run longest"]) == (18.0, 20.0)
    assert {name: value for name, value in found.items() if name.startswith("drive ")} == {
        "drive passes": 2,
        "drive failures": 0,
        "drive median": 2.0,
        "drive longest": 3.0,
    }
    assert (found["pick passes"], found["pick failures"]) == (1, 1)
