"""Reference solvers for allocation: auction, objectives, search, and simple rules over arrays."""
