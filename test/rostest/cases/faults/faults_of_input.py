# SPDX-License-Identifier: BSD-3-Clause
"""A hive of real nodes survives thousands of malformed messages on every topic."""

import io
import math
import random
import socket
import subprocess
import sys
import xmlrpc.client
from pathlib import Path

import blackboard.msg as bb_msgs
import pytest
import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseWithCovarianceStamped
from held_clock import HeldHive
from std_msgs.msg import String

from hive_lab.live.fake_base import FakeBase
from hive_lab.live.live_operator import LiveOperator, make_task
from hive_lab.runner.limits import PATIENCE

MESSAGES = 5000
AT_ONCE = 100
PER_SECOND = 400
ROBOTS = ("robot1", "robot2")
REFUSED_POSE = "a message on amcl_pose is refused"
TOPICS = {
    "new_task": bb_msgs.TaskMsg,
    "task_bc": bb_msgs.TaskMsgArray,
    "task_cost": bb_msgs.TaskCostArray,
    "task_assign": bb_msgs.TaskMsg,
    "task_state": bb_msgs.TaskState,
    "robot_status": bb_msgs.RobotStatus,
    "bb_backup": bb_msgs.BbBackup,
    "bb_sync": bb_msgs.BbSynch,
    "bb_entries": bb_msgs.BbEntries,
    "bb_ack": bb_msgs.BbAck,
    "bb_vote": bb_msgs.BbVote,
    "task_cancel": String,
    "robot1/set_state": String,
}
FLOATS = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e308)
NOT_UTF_8 = b"\xff\xfe\x80"
PLACEHOLDER = "\x01\x01\x01"
"""Replaces NOT_UTF_8, which genpy refuses to send, until it is on the wire."""
TEXTS = ("", "nobody", PLACEHOLDER, "\x00", "a b", "../..")
EPOCHS = (0, 2**32 - 1)
LIMITS = {"uint8": 255, "uint16": 65_535, "uint32": 2**32 - 1}


class Nonsense:
    """Fills messages of any type with odd values, and truncates some on the wire.

    Args:
        seed: Of the choice.
    """

    def __init__(self, seed):
        self.draw = random.Random(seed)

    def fill(self, message):
        for slot, kind in zip(message.__slots__, message._slot_types, strict=True):  # noqa: SLF001  (genpy's name for them)
            setattr(message, slot, self.value(slot, kind, getattr(message, slot)))
        if isinstance(message, bb_msgs.TaskMsg):
            message.priority = self.draw.randint(11, 255)  # so that none of it is a task
        if isinstance(message, bb_msgs.TaskState):
            message.assignment = 0
        return message

    def value(self, slot, kind, default):
        if kind.endswith("[]"):
            inner = kind[:-2]
            return [
                self.value(slot, inner, self.new(inner)) for _ in range(self.draw.randint(0, 2))
            ]
        if kind in {"time", "std_msgs/Header"}:
            return default
        choices = {"string": TEXTS, "bool": (True, False), "float64": FLOATS}.get(kind)
        if slot in {"epoch", "list_epoch", "seen", "before_epoch"}:
            choices = EPOCHS
        elif kind in LIMITS:
            choices = (0, 1, 2, LIMITS[kind])
        return self.fill(default) if choices is None else self.draw.choice(choices)

    @staticmethod
    def new(kind):
        package, _, name = kind.partition("/")
        if not name:
            return ""
        module = __import__(f"{package}.msg", fromlist=[name])
        return getattr(module, name)()


def on_the_wire(kind, change):
    """Return a class of the same type whose messages are changed where they are bytes."""

    class Changed(kind):
        def serialize(self, buff):
            whole = io.BytesIO()
            super().serialize(whole)
            buff.write(change(whole.getvalue()))

    return Changed


def no_text(data):
    return data.replace(PLACEHOLDER.encode(), NOT_UTF_8)


ODD = {topic: on_the_wire(kind, no_text) for topic, kind in TOPICS.items()}


@pytest.fixture(scope="module")
def hive(tmp_path_factory):
    """A hive of three members, whose clock the test has."""
    rospy.init_node("faults", anonymous=True, disable_signals=True)
    hive = HeldHive(tmp_path_factory.mktemp("hive"), "/input/", ROBOTS)
    hive.drives = [FakeBase(f"/input/{name}", x=float(i)) for i, name in enumerate(ROBOTS)]
    hive.operator = LiveOperator(hive.namespace, hive.members)
    hive.speak = {
        topic: rospy.Publisher(f"/input/{topic}", kind, queue_size=1000)
        for topic, kind in TOPICS.items()
    }
    hive.told = {}
    rospy.Subscriber("/diagnostics", DiagnosticArray, lambda said: note(hive.told, said))
    try:
        hive.start_all()
        hive.operator.wait_until_whole()
        yield hive
    finally:
        hive.end()


def note(told, said):
    for status in said.status:
        told[status.name] = {value.key: value.value for value in status.values}


def still_works(hive, task_id):
    """Check that every node runs, and that a task gets done once."""
    operator = hive.operator
    goal = (1.0, float(len(operator.updates)))

    assert hive.ended() == ()
    assert operator.post(make_task(task_id, goal)).state == bb_msgs.TaskState.WAITING
    assert operator.follow(task_id) == bb_msgs.TaskState.DONE
    assert sum(drive.arrivals.count(goal) for drive in hive.drives) == 1


def test_a_second_robot_of_the_same_name_is_refused(hive):
    status = hive.operator.robots["robot1"]
    for _ in range(5):
        hive.speak["robot_status"].publish(status)
    active = hive.operator.last.active
    hive.operator.demand(
        lambda: "speaks as robot1, which /input/robot1/robot does already" in hive.log_of(active),
        "the second robot1 is named",
    )
    still_works(hive, "after-double")


@pytest.mark.parametrize("odd", [1e308, -1e308, 3.5e38, math.nan, math.inf])
def test_a_task_to_an_absurd_place_is_rejected_and_ends_no_node(hive, odd):
    answer = hive.operator.post(make_task(f"far{odd}", (odd, 2.0)))

    assert answer.state == bb_msgs.TaskState.REJECTED
    assert "goal A" in answer.reason
    still_works(hive, f"after-far{odd}")


NO_POSES = {
    "NaN": (math.nan, 0.0, 1.0),
    "far": (1e308, 0.0, 1.0),
    "no orientation": (0.0, 0.0, 0.0),
    "long quaternion": (0.0, 0.0, 1e200),
}
"""x [m], y [m] and w of the quaternion."""


@pytest.mark.parametrize("name", NO_POSES)
def test_a_pose_that_is_none_is_refused_and_ends_no_node(hive, name):
    x, y, w = NO_POSES[name]
    message = PoseWithCovarianceStamped()
    message.pose.pose.position.x, message.pose.pose.position.y = x, y
    message.pose.pose.orientation.w = w
    speak = rospy.Publisher("/input/robot1/amcl_pose", PoseWithCovarianceStamped, queue_size=1)
    hive.operator.demand(speak.get_num_connections, "robot1 listens to its pose")
    refused = hive.log_of("/input/robot1/robot").count(REFUSED_POSE)
    speak.publish(message)
    hive.operator.demand(
        lambda: hive.log_of("/input/robot1/robot").count(REFUSED_POSE) > refused,
        f"robot1 refuses the pose: {name}",
    )
    still_works(hive, f"after-{name.replace(' ', '-')}")


def flood(hive):
    """Publish odd messages."""
    nonsense = Nonsense(seed=1)
    rate = rospy.Rate(PER_SECOND)
    for number in range(1, MESSAGES + 1):
        topic = nonsense.draw.choice(sorted(TOPICS))
        hive.speak[topic].publish(nonsense.fill(ODD[topic]()))
        rate.sleep()
        if number % AT_ONCE == 0:
            # A busy machine works them off more slowly than they come; the next ones wait for it.
            # The leader's heartbeats do not tell that answers wait to be read; its answer does.
            hive.operator.post(make_task(f"up-to-date-{number}", (math.nan, 2.0)))
            hive.operator.wait_until_up_to_date(hive.clock.now())


def test_thousands_of_odd_messages_change_nothing_and_are_counted(hive):
    epoch, active = hive.operator.last.epoch, hive.operator.last.active
    with hive.held():  # a machine that is slow is no reason for a takeover
        flood(hive)
    assert (hive.operator.last.epoch, hive.operator.last.active) == (epoch, active)
    still_works(hive, "after-nonsense")

    name = f"{active.strip('/')}: hive"
    hive.operator.demand(
        lambda: int(hive.told.get(name, {}).get("refused", 0)) > MESSAGES / 4,
        f"the diagnostics of {name} count what it has refused",
    )
    assert hive.log_of(active).count("refused") < MESSAGES / 10


def test_a_burst_of_a_thousand_odd_messages_is_worked_through(hive):
    nonsense = Nonsense(seed=2)
    for _ in range(1000):
        hive.speak["task_state"].publish(nonsense.fill(ODD["task_state"]()))
    still_works(hive, "after-burst")


def test_texts_of_ten_megabytes_are_refused(hive):
    huge = "x" * 10_000_000
    hive.speak["new_task"].publish(make_task(huge, (1.0, 1.0)))
    hive.speak["task_state"].publish(bb_msgs.TaskState(task_id=huge))
    hive.speak["task_cancel"].publish(huge)
    hive.speak["robot_status"].publish(bb_msgs.RobotStatus(robot_id=huge))
    hive.speak["bb_ack"].publish(bb_msgs.BbAck(member=huge))
    still_works(hive, "after-huge")


def say_too_little(hive):
    """Publish truncated messages on every topic."""
    rospy.init_node("truncating", anonymous=True)
    for topic, kind in TOPICS.items():
        speak = rospy.Publisher(f"{hive}{topic}", kind, queue_size=10)
        while speak.get_num_connections() == 0 and not rospy.is_shutdown():
            rospy.sleep(0.05)
        for share in (0.0, 0.3, 0.9):
            cut = on_the_wire(kind, lambda data, share=share: data[: int(share * len(data))])
            speak.publish(Nonsense(seed=3).fill(cut()))


def test_messages_that_end_too_early_cost_only_their_sender_its_connection(hive):
    code = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); "
    code += "import faults_of_input; faults_of_input.say_too_little('/input/')"
    subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE)
    still_works(hive, "after-truncated")


def heartbeat_port(hive):
    """Return address and port of the leader's heartbeat."""
    active = hive.operator.last.active
    node = xmlrpc.client.ServerProxy(rosgraph.Master("/faults").lookupNode(active))
    _, _, (_, host, port) = node.requestTopic("/faults", "/input/bb_backup", [["TCPROS"]])
    return host, port


def first_words(md5):
    """Return the header of a subscriber of the heartbeat."""
    fields = [
        "callerid=/faults",
        "topic=/input/bb_backup",
        "type=blackboard/BbBackup",
        f"md5sum={md5}",
    ]
    header = b"".join(len(f).to_bytes(4, "little") + f.encode() for f in fields)
    return len(header).to_bytes(4, "little") + header


def test_random_bytes_and_a_wrong_md5_on_the_port_of_a_topic_end_nothing(hive):
    draw = random.Random(4)
    for data in (
        first_words("0123456789abcdef0123456789abcdef"),
        *(draw.randbytes(draw.randint(1, 4000)) for _ in range(20)),
    ):
        with socket.create_connection(heartbeat_port(hive), timeout=PATIENCE) as connection:
            connection.sendall(data)
    still_works(hive, "after-bytes")


def test_a_caller_that_stops_before_its_first_words_keeps_nobody_else_out(hive):
    port = heartbeat_port(hive)
    with (
        socket.create_connection(port, timeout=PATIENCE),
        socket.create_connection(port, timeout=PATIENCE) as caller,
    ):
        caller.sendall(first_words(bb_msgs.BbBackup._md5sum))  # noqa: SLF001  (the only way to know it)

        assert b"topic=/input/bb_backup" in caller.recv(4096)
