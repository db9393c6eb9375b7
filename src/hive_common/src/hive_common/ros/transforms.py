# SPDX-License-Identifier: BSD-3-Clause
"""Transforms that go on when ROS time is set back."""

from __future__ import annotations

import rospy
import tf2_ros

from hive_common.ros.onward_clock import SetBack


class Transforms(tf2_ros.Buffer):  # type: ignore[misc]  # tf2_ros is not typed
    """The transforms of `/tf` and `/tf_static` of the last seconds.

    tf2 refuses transforms that are older by `cache_time` than what it has. After `/clock` was set
    back, for example because a recording is played again, that is all of them. So this buffer
    forgets what it has then; fixed transforms stay.

    Args:
        cache_time: How long a transform is kept [s].
    """

    def __init__(self, cache_time: float) -> None:
        super().__init__(cache_time=rospy.Duration.from_sec(cache_time))
        self._was_set_back = SetBack(rospy.get_time)
        self._listener = tf2_ros.TransformListener(self)

    def set_transform(self, transform: object, authority: str) -> None:
        """Take in a transform, as the listener does."""
        if self._was_set_back():
            self.clear()
        super().set_transform(transform, authority)

    def close(self) -> None:
        """Stop listening."""
        self._listener.unregister()
