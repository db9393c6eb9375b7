"""Driving along a path to a goal: follower, obstacle check, goal tracker, and the navigator.

Finding the path belongs in `planning`, the right of way in `traffic`.
"""
