"""The opposite direction: any VDA 5050 master drives a `move_base` robot.

The vehicle's side of the protocol on top of two actions, `move_base` and `pick`. Nothing here
knows ROS.
"""
