"""The blackboard of the leader: takes tasks in, orders robots, and watches over them.

How it is decided who gets a task belongs in `auction`; how the list is replicated in `consensus`.
"""
