"""Robots that meet: who goes first, and where the others wait.

The rule knows only what robots announce; what the laser sees belongs in `control`.
"""
