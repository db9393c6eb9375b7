"""A simulated AGV: the vehicle's side of the protocol on a base of the simulator or of a test.

Its clock and its base come from outside; nothing here knows ROS or the simulator.
"""
