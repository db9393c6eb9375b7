"""The search for a plan: which robot does which tasks, in which order, over arrays of numbers.

What is known of robots and tasks belongs in `costing`; what becomes of a plan in `auction`.
"""
