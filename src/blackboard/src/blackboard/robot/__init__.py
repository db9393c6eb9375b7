"""One robot of the hive: it bids, executes its tasks, keeps its lease and charges.

What the leader decides belongs in `board`; what a task costs in `costing`.
"""
