"""Values that every other folder speaks of: tasks, records, robots, settings, the Talker port.

Nothing here decides. What computes a cost belongs in `costing`, what replicates in `consensus`.
"""
