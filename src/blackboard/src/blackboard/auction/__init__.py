"""Who gets which task: auctions, candidate selection, reallocation, splitting, decisions.

What a bid is computed from belongs in `costing`; what is ordered from robots in `board`.
"""
