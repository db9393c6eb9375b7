"""Translates between ROS messages and the values of the core, and nothing else."""
