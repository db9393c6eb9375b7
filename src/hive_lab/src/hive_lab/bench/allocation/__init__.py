"""Measures how good and how quick the allocation of tasks is."""
