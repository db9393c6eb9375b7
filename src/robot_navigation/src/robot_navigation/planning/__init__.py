"""Paths on a map: the planner's port, its OMPL adapter, and the roadmap that guides it."""
