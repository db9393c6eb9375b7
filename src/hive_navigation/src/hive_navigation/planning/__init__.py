"""Paths on a map: the planner port, its OMPL adapter, the roadmap that guides it, and polylines.

What moves the robot along a path belongs in `control`, what keeps robots apart in `traffic`.
"""
