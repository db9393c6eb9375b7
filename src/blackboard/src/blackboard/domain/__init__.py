"""Values that every other folder speaks of: tasks, records, robots, settings, the Talker port.

Nothing here decides anything. What computes a cost belongs in `costing`, what replicates the list in
`consensus`.
"""
