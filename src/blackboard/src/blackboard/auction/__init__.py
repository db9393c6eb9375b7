"""Which robot gets which task: auctions, plans, splitting, and why it was decided so.

What a bid is computed from belongs in `costing`; what is ordered from robots in `board`.
"""
