# SPDX-License-Identifier: BSD-3-Clause
import threading
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from click.testing import CliRunner

from fleet_manager.ros.fleet_setting import fleet_setting


@pytest.fixture
def master(monkeypatch):
    """A ROS master that knows parameters; the test fills them in."""
    parameters = {}

    def get_param(_caller, name):
        return (1, "", parameters[name]) if name in parameters else (-1, "not set", 0)

    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server:
        server.register_function(get_param, "getParam")
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        monkeypatch.setenv("ROS_MASTER_URI", f"http://127.0.0.1:{server.server_address[1]}")
        yield parameters
        server.shutdown()
        thread.join()


def said(name):
    return CliRunner().invoke(fleet_setting, [name]).output


def test_a_robot_that_joins_bids_as_the_fleet_that_is_running(master):
    master["/fleet/cost_model"] = "energy"

    assert said("cost_model") == "energy"


def test_where_no_fleet_is_running_the_defaults_hold(master):
    assert master == {}
    assert (said("cost_model"), said("distance")) == ("report", "path")


def test_where_no_master_answers_the_defaults_hold(monkeypatch):
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")

    assert said("cost_model") == "report"
