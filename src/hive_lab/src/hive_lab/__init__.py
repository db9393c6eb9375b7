"""The laboratory: benchmarks, simulated and live hives, fault schedules, virtual fleets.

Only tests and `./hive bench` use it; nothing that a node runs belongs here.
"""
