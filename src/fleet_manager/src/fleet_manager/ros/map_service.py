# SPDX-License-Identifier: BSD-3-Clause
"""Asks the hive's map server to read another file."""

from __future__ import annotations

import queue
import threading
from typing import TYPE_CHECKING

import rospy
from nav_msgs.srv import LoadMap, LoadMapResponse

from fleet_manager.errors import NoHiveError, NotDoneError

if TYPE_CHECKING:
    from pathlib import Path

_SERVICE = "change_map"
_FOUND_WITHIN = 3.0  # [s] in which the ROS master knows of the service and its node answers
_READ_WITHIN = 60.0  # [s] in which the largest map is read

_WHY_NOT = {
    LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST: "there is no such file on its machine",
    LoadMapResponse.RESULT_INVALID_MAP_DATA: "the file's image cannot be used",
    LoadMapResponse.RESULT_INVALID_MAP_METADATA: "the file cannot be used",
}


def change_map(path: Path) -> None:
    """Have the map server read a file; see `fleet_manager.client.client.ClientLink.change_map`."""
    try:
        rospy.wait_for_service(_SERVICE, timeout=_FOUND_WITHIN)
    except rospy.ROSException:
        raise NoHiveError(
            f"no map server with the service {rospy.resolve_name(_SERVICE)} answers; start the "
            "hive with its own map server, or have yours publish the new map on the topic map"
        ) from None
    answers: queue.SimpleQueue[LoadMapResponse | rospy.ServiceException] = queue.SimpleQueue()
    # A call to a node that is frozen does not return.
    threading.Thread(target=_call, args=(path, answers), daemon=True).start()
    try:
        answer = answers.get(timeout=_READ_WITHIN)
    except queue.Empty:
        raise NoHiveError(f"the map server does not answer within {_READ_WITHIN:g} s") from None
    if isinstance(answer, rospy.ServiceException):
        raise NoHiveError(f"the map server ended the call: {answer}")
    if answer.result != LoadMapResponse.RESULT_SUCCESS:
        why = _WHY_NOT.get(answer.result, f"result {answer.result}")
        raise NotDoneError(f"the map server does not use {path}: {why}; its log says more")


def _call(
    path: Path, answers: queue.SimpleQueue[LoadMapResponse | rospy.ServiceException]
) -> None:
    try:
        answers.put(rospy.ServiceProxy(_SERVICE, LoadMap)(str(path)))
    except rospy.ServiceException as error:
        answers.put(error)
