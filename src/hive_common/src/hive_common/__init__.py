"""What several packages need: poses, maps, checked YAML files, and helpers for nodes.

Nothing here knows of tasks, robots' tasks or the simulator.
"""
