# SPDX-License-Identifier: BSD-3-Clause
"""What is said when the map server does not do what it is asked."""

from pathlib import Path

import pytest

pytest.importorskip("rospy", reason="the service is one of ROS")

import rospy
from nav_msgs.srv import LoadMapResponse

from fleet_manager.errors import NoHiveError, NotDoneError
from fleet_manager.ros import map_service
from fleet_manager.ros.map_service import change_map

FILE = Path("/maps/hall.yaml")


def serve(monkeypatch, answer, found=True):
    """Have a map server answer; return what it was asked."""
    asked = []

    def wait(_name, timeout):  # noqa: ARG001  (rospy's argument)
        if not found:
            raise rospy.ROSException

    def call(name):
        asked.append(name)
        return answer()

    monkeypatch.setattr(rospy, "wait_for_service", wait)
    monkeypatch.setattr(rospy, "resolve_name", lambda name: f"/{name}")
    monkeypatch.setattr(rospy, "ServiceProxy", lambda _name, _kind: call)
    return asked


def test_the_map_server_is_asked_for_the_file(monkeypatch):
    asked = serve(monkeypatch, lambda: LoadMapResponse(result=LoadMapResponse.RESULT_SUCCESS))
    change_map(FILE)

    assert asked == ["/maps/hall.yaml"]


@pytest.mark.parametrize(
    ("result", "words"),
    [
        (LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST, "there is no such file on its machine"),
        (LoadMapResponse.RESULT_INVALID_MAP_DATA, "image cannot be used"),
        (LoadMapResponse.RESULT_INVALID_MAP_METADATA, "the file cannot be used"),
        (LoadMapResponse.RESULT_UNDEFINED_FAILURE, "result 255"),
    ],
)
def test_why_a_file_is_not_used_is_said_in_words(monkeypatch, result, words):
    serve(monkeypatch, lambda: LoadMapResponse(result=result))

    with pytest.raises(NotDoneError, match=f"does not use {FILE}: .*{words}"):
        change_map(FILE)


def test_a_master_that_knows_of_no_map_server_is_no_hive(monkeypatch):
    serve(monkeypatch, LoadMapResponse, found=False)

    with pytest.raises(NoHiveError, match="no map server with the service /change_map answers"):
        change_map(FILE)


def test_a_map_server_that_ends_during_the_call_is_no_answer(monkeypatch):
    def die():
        raise rospy.ServiceException("transport error")

    serve(monkeypatch, die)

    with pytest.raises(NoHiveError, match="transport error"):
        change_map(FILE)


def test_a_map_server_that_is_frozen_is_not_waited_for_without_end(monkeypatch):
    frozen = map_service.threading.Event()
    serve(monkeypatch, frozen.wait)
    monkeypatch.setattr(map_service, "_READ_WITHIN", 0.01)

    with pytest.raises(NoHiveError, match="does not answer"):
        change_map(FILE)
    frozen.set()
