"""One replicated task list: Raft's election, log replication and journal.

What a committed change means for tasks and robots belongs in `board`.
"""
