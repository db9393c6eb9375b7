# SPDX-License-Identifier: BSD-3-Clause
"""One simulated AGV in a hall of the simulator, on virtual time, and a master that hears it."""

import pytest

from vda5050.protocol.versions import Version
from vda5050.simulated.testing import Rig


@pytest.fixture
def rig():
    return Rig(Version.V2_1)


@pytest.fixture(params=list(Version), ids=lambda version: version.value)
def each_version(request):
    return Rig(request.param)
