"""Odd messages: valid ones of a hive at work with some of their fields changed, and what they do.

It needs the messages of ROS and no master: the hive runs in this process on virtual time.
"""
