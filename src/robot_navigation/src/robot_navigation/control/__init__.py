"""Drives a robot along a path: follower, obstacle check, and the navigator that runs both."""
