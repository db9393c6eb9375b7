"""Measures the operator's windows on a fake fleet, and takes the documentation's pictures."""
