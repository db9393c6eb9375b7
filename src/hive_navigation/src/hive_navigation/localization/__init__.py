"""Where a robot is on its map: the particle filter and its models of odometry and laser.

Making a map belongs in `mapping`.
"""
