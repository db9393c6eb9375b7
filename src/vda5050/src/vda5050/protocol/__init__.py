"""The messages of VDA 5050, versions 2.0, 2.1 and 3.0: values, schemas, JSON, topic names.

Nothing here knows a network, a robot or a task. Fields have the names of version 3.0; what other
versions call them stands in `versions.py`, and nowhere else.
"""
