"""Whole hives on a simulated network with every kind of fault, checked after every event."""
