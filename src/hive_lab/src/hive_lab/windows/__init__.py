"""Measures the operator's windows and takes their pictures."""
