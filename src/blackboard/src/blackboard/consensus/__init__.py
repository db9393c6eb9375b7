"""One replicated task list: Raft's election and log, with the report's roles.

What the list means to tasks and robots does not belong here; the blackboard that decides is in `board`.
"""
