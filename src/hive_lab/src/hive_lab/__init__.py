"""The laboratory: benchmarks, hives, fault schedules, virtual fleets, runs of tests.

Only tests, `./hive test`, `./hive bench` and `hive compare` use it; nothing that a node runs
belongs here.
"""
