# SPDX-License-Identifier: BSD-3-Clause
"""What a running system promises to users: asked of the ROS master, and of the nodes themselves.

Left out is what every node has by itself (the two services of its log) and what differs from run
to run (the parameters of roslaunch). A path of the workspace is cut down to the name of its file.
"""

import contextlib
import hashlib
import re
import time
import xmlrpc.client

import genpy.message
import rosgraph
import roslaunch
import rosservice
from interface_files import FIND, ROOT, package_of
from interface_list import RECORDS, check, differences, recorded
from launching import wait_until_empty

MASTER = rosgraph.Master("/interfaces")
QUIET = 30.0 if RECORDS else 180.0
"""Wall time without any change after which a system is taken as it is, unless it is as expected
[s]. Only a list is recorded on a machine with nothing else to do."""
OF_EVERY_NODE = ("/get_loggers", "/set_logger_level")
OF_EVERY_RUN = {"run_id", "rosdistro", "rosversion", "roslaunch", "journal", "launch_fleet"}
"""First parts of the names of parameters that differ, or that users have no use for."""
OF_EVERY_START = {"/traffic_planner/epoch"}
"""Parameters that differ whenever a hive is started."""
ANONYMOUS = re.compile(r"_\d+_\d{13}\b")
PLACE = re.compile(rf"{re.escape(str(ROOT))}(/[\w.-]+)*/")
LONG = 300
"""A text with more characters is recorded by its md5sum."""


class Watch:
    """Looks at a system until it is as expected, or until nothing more happens in it.

    Args:
        expected: The recorded system; None: none is.
    """

    def __init__(self, expected):
        self.found = {}
        self._expected = expected
        self._changed = time.monotonic()

    def unsettled(self):
        """Look; return what keeps the system from being settled."""
        found = system()
        now = time.monotonic()
        if found != self.found:
            self.found, self._changed = found, now
        if found == self._expected == system() or now - self._changed > QUIET:
            return []
        return list(differences(self._expected or {}, found)) or ["it changes"]


def system():
    """Return everything that can be seen of the system that is running."""
    state = MASTER.getSystemState()
    publishers, subscribers, services = map(dict, state)
    types = dict(MASTER.getTopicTypes())
    topics = {
        topic: {
            "type": _type_and_sum(types.get(topic, "*")),
            "publishers": _names(publishers.get(topic, ())),
            # Whether a window hears /clock depends on whether it started before the simulator.
            "subscribers": _names(subscribers.get(topic, ()) if topic != "/clock" else ()),
        }
        for topic in {**publishers, **subscribers}
    }
    return {
        "nodes": _names(node for kind in state for _, nodes in kind for node in nodes),
        "topics": topics,
        "actions": _actions(topics),
        "services": {
            name: {"type": _service(name), "nodes": _names(servers)}
            for name, servers in services.items()
            if not name.endswith(OF_EVERY_NODE)
        },
        "parameters": recordable(leaves(MASTER.getParam("/"))),
        "missing connections": _missing_connections(publishers, subscribers),
    }


def _names(found):
    """Return nodes in order, those with a name of their own for every run under one."""
    return sorted({ANONYMOUS.sub("_*", name) for name in found})


def _actions(topics):
    """Return the actions that are among the topics."""
    found = {}
    for topic, goal in topics.items():
        name = topic.removesuffix("/goal")
        result, cancel = topics.get(f"{name}/result"), topics.get(f"{name}/cancel")
        if name != topic and result and cancel:
            kind = goal["type"].partition("Goal ")[0]
            servers, clients = result["publishers"], cancel["publishers"]
            found[name] = {"type": kind, "servers": servers, "clients": clients}
    return found


def _type_and_sum(kind):
    """Return the name of a message type with its md5sum."""
    message = genpy.message.get_message_class(kind) if "/" in kind else None
    return f"{kind} {message._md5sum}" if message else kind  # noqa: SLF001  (genpy's own name)


def _service(name):
    """Return type and md5sum of a service, which only its node knows."""
    with contextlib.suppress(OSError, rosgraph.MasterException, rosservice.ROSServiceException):
        uri = MASTER.lookupService(name)
        headers = rosservice.get_service_headers(name, uri)
        return f"{headers['type']} {headers['md5sum']}"
    return "no answer"


def leaves(tree, name=""):
    """Return the parameters of a tree by their full names."""
    if not isinstance(tree, dict) or not tree:
        return {name: tree}
    return {
        path: value
        for key, branch in tree.items()
        for path, value in leaves(branch, f"{name}/{key}").items()
    }


def recordable(parameters):
    """Return parameters as they are in every run and on every machine."""
    return {
        name: plain(value)
        for name, value in parameters.items()
        if name.split("/")[1] not in OF_EVERY_RUN and name not in OF_EVERY_START
    }


def plain(value):
    """Return a value without places in the workspace, and long texts by their md5sum."""
    if not isinstance(value, str):
        return value
    text = FIND.sub("$(find *)", PLACE.sub(".../", value))
    if len(text) <= LONG:
        return text
    return f"md5sum {hashlib.md5(text.encode(), usedforsecurity=False).hexdigest()}"


def _missing_connections(publishers, subscribers):
    """Return the connections between nodes that should stand and do not: who, topic, to whom."""
    wanted = {
        (speaker, topic, listener)
        for topic, listeners in subscribers.items()
        for speaker in publishers.get(topic, ())
        for listener in listeners
        if speaker != listener
    }
    standing = {link for speaker in {link[0] for link in wanted} for link in _links_of(speaker)}
    return _names(f"{who} on {what} to {whom}" for who, what, whom in wanted - standing)


def _links_of(speaker):
    """Return the connections on which a node speaks; none of one that does not answer."""
    with contextlib.suppress(OSError, rosgraph.MasterException, xmlrpc.client.Error):
        with xmlrpc.client.ServerProxy(MASTER.lookupNode(speaker)) as slave:
            links = slave.getBusInfo("/interfaces")[2]
        return [(speaker, link[4], link[1]) for link in links if link[2] == "o"]
    return []


def md5sum_of(definition):
    """Return the md5sum of a message, a service or an action."""
    of_messages, of_services = genpy.message.get_message_class, genpy.message.get_service_class
    kind = of_messages(definition) or of_services(definition) or of_messages(f"{definition}Action")
    return kind._md5sum  # noqa: SLF001  (genpy's own name)


def launched(file, arguments):
    """Find out what a launch file would start and set, without having it do so.

    Returns:
        The command, and its nodes and parameters.
    """
    words = [f"{name}:={value}" for name, value in arguments.items()]
    config = roslaunch.config.ROSLaunchConfig()
    (path,) = roslaunch.rlutil.resolve_launch_arguments(file.split())
    roslaunch.xmlloader.XmlLoader().load(path, config, argv=words, verbose=False)
    parameters = {}
    for each in config.params.values():
        parameters |= leaves(each.value, each.key)
    return " ".join([file, *words]), {
        "nodes": {
            f"{node.namespace}{node.name}": plain(f"{node.type} {node.args}".strip())
            for node in config.nodes
        },
        "parameters": recordable(parameters),
    }


def rosrun(executable, *words):
    """Return the command that runs an executable, whatever its package is."""
    return ["rosrun", package_of(executable), executable, *words]


def wait_for_parameter(name):
    """Wait until a launch file has set a parameter."""
    wait_until_empty(lambda: [] if MASTER.hasParam(name) else [name])


def check_system(name):
    """Wait until the system that is starting stands; compare it with the one of the list."""
    watch = Watch(recorded(name))
    wait_until_empty(watch.unsettled)
    check(name, watch.found)
