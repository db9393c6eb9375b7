"""One replicated task list: Raft's election and log, with the report's roles.

What a change means to tasks and robots belongs in `board`.
"""
