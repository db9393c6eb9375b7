"""The vehicle's side of the protocol: which orders it takes, and how it carries them out.

What drives and works is behind the ports of `ports.py`, so a simulated AGV and a `move_base` robot
behave the same towards a master. Nothing here knows the hive, which is the master's side.
"""
