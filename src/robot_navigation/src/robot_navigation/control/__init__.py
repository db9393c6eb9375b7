"""Drives a robot along a path: the follower, the obstacle check, and the navigator that runs both."""
