# SPDX-License-Identifier: BSD-3-Clause
import pytest

from fleet_manager.client.comparison import ARCHITECTURES
from fleet_manager.config.load import Load
from hive_common.errors import FileError
from hive_common.map_file import load_map
from hive_common.resources import names_in
from hive_lab.architectures.kinds import BUILDERS
from hive_lab.compare.experiment import RUN_ON, Variant, read_experiment

GOOD = """\
fleet: lab
load: {at_once: 3, mix: {GA: 1}}
world: lab
decisions: [distributed, planned]
cost_models: [time, latency]
seeds: [4, 7]
"""


@pytest.fixture
def written(tmp_path):
    def write(text):
        path = tmp_path / "mine.yaml"
        path.write_text(text, encoding="utf-8")
        return str(path)

    return write


@pytest.mark.parametrize("name", names_in("fleet_manager", "experiments"))
def test_the_experiments_that_come_along_can_be_read_and_say_what_they_are_for(name):
    experiment = read_experiment(name)

    assert experiment.description
    assert experiment.scenario_of(experiment.seeds[0]).tasks


def test_every_decision_is_made_with_every_cost_model_and_variants_take_turns(written):
    experiment = read_experiment(written(GOOD))

    assert [variant.label for variant in experiment.variants] == [
        "distributed, time", "distributed, latency", "planned, time", "planned, latency",
    ]  # fmt: skip
    assert [seed for _, seed in experiment.runs] == [4, 4, 4, 4, 7, 7, 7, 7]
    fleet = experiment.fleet_of(Variant("hive", "distributed", "time"))
    assert (fleet.decision, fleet.cost_model) == ("distributed", "time")


def test_what_is_left_out_is_as_the_fleet_file_says(written):
    experiment = read_experiment(written("fleet: lab\nscenario: demo\n"))

    assert experiment.variants == (Variant("hive", "planned", "latency"),)
    assert experiment.scenario_of(1).world == "lab"


def test_only_the_hive_is_combined_with_decisions(written):
    experiment = read_experiment(written(GOOD + "architectures: [hive, report, contract_net]\n"))

    assert [variant.label for variant in experiment.variants] == [
        "distributed, time",
        "distributed, latency",
        "planned, time",
        "planned, latency",
        "report's blackboard, time",
        "report's blackboard, latency",
        "contract net, time",
        "contract net, latency",
    ]
    assert len({variant.file_name for variant in experiment.variants}) == 8


def test_the_architectures_that_can_be_chosen_are_those_that_can_be_built():
    assert set(BUILDERS) == set(ARCHITECTURES)


@pytest.mark.parametrize("run_on", RUN_ON)
def test_a_process_can_be_killed_or_stand_still_for_a_while(written, run_on):
    faults = "[{after: 3, kill: blackboard}, {after: 5, freeze: robot2, seconds: 4}]"

    experiment = read_experiment(written(f"{GOOD}faults: {faults}\nrun_on: {run_on}\n"))

    assert [fault.process for fault in experiment.faults] == ["blackboard", "robot2"]
    assert [fault.seconds for fault in experiment.faults] == [None, 4.0]


def test_each_seed_draws_tasks_of_its_own_and_the_same_again(written):
    experiment = read_experiment(written(GOOD))

    first, again, other = (experiment.scenario_of(seed).tasks for seed in (4, 4, 7))

    assert first == again != other
    assert len(first) == 3


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("fleet: lab\n", "give either scenario or load"),
        ("fleet: lab\nscenario: demo\nload: {at_once: 1}\nworld: lab\n", "give either"),
        ("fleet: lab\nload: {at_once: 1}\n", "world: missing; a load needs"),
        ("fleet: lab\nload: {}\nworld: lab\n", "no task would arrive"),
        (
            "fleet: lab\nscenario: demo\ndecisions: [chance]\n",
            "allowed: distributed | centralized",
        ),
        ("fleet: lab\nscenario: demo\nseeds: [1, 1]\n", "at least one seed, each once"),
        (
            "fleet: lab\nscenario: demo\nfaults: [{after: 3, kill: robot9}]\n",
            "faults[0].kill: 'robot9' is not in the fleet; allowed: robot1, robot2",
        ),
        (
            "fleet: lab\nscenario: demo\nfaults: [{after: 3, freeze: robot9, seconds: 1}]\n",
            "faults[0].freeze: 'robot9' is not in the fleet",
        ),
        (
            "fleet: lab\nscenario: demo\nfaults: [{after: 3}]\n",
            "faults[0]: give either kill or freeze",
        ),
        (
            "fleet: lab\nscenario: demo\nfaults: [{after: 3, kill: robot1, freeze: robot1}]\n",
            "faults[0]: give either kill or freeze",
        ),
        (
            "fleet: lab\nscenario: demo\nfaults: [{after: 3, freeze: robot1}]\n",
            "faults[0].seconds: give it with freeze",
        ),
        (
            "fleet: lab\nscenario: demo\nfaults: [{after: 3, kill: robot1, seconds: 2}]\n",
            "faults[0].seconds: give it with freeze",
        ),
        ("fleet: lab\nscenario: demo\nloss: 0.6\n", "a share of the messages, 0..0.5"),
        (
            "fleet: lab\nscenario: demo\nloss: 0.1\nrun_on: simulator\n",
            "loss: 0.1: messages are lost on virtual time only",
        ),
        ("fleet: lab\nscenario: demo\narchitectures: [chance]\n", "allowed: hive | report"),
        (
            "fleet: lab\nscenario: demo\narchitectures: [hive, central]\nrun_on: simulator\n",
            "architectures[1]: 'central' runs on virtual time only",
        ),
        ("fleet: mixed\nscenario: demo\n", "speak VDA 5050"),
    ],
)
def test_a_mistake_is_named_with_what_is_allowed(written, text, said):
    with pytest.raises(FileError, match="mine") as caught:
        read_experiment(written(text))

    assert said in str(caught.value)


def test_a_fleet_that_is_not_there_is_named_with_those_that_are(written):
    with pytest.raises(FileError, match="fleet 'nowhere': not known; allowed: lab"):
        read_experiment(written("fleet: nowhere\nscenario: demo\n"))


def test_a_load_arrives_at_random_times_at_its_rate():
    load = Load(at_once=5, per_hour=600.0, minutes=60.0, mix={"GA": 1.0, "GAB": 3.0})
    planned = load.draw(load_map("lab"), seed=1)
    times = [each.after for each in planned]
    pairs = [each.task.type.name for each in planned].count("GAB")

    assert times[:5] == [0.0] * 5
    assert times == sorted(times)
    assert times[-1] <= 3600.0
    assert len(times) == pytest.approx(605, abs=75)  # three standard deviations
    assert pairs / len(times) == pytest.approx(0.75, abs=0.06)
    assert len({each.task.id for each in planned}) == len(planned)
