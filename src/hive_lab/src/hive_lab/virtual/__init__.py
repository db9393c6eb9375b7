"""Hives of the real classes on virtual time and a virtual network, for tests and benchmarks."""
