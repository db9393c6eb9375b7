"""The hive's side: what makes an AGV a robot of the hive. Nothing here knows ROS or a broker.

Everything belongs to one thread and gets the time from outside.
"""
