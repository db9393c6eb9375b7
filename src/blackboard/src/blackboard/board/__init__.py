"""The leader's blackboard: takes tasks in, orders robots, and watches over them.

How it is decided who gets a task belongs in `auction`; how the list is replicated in `consensus`.
"""
