"""Helpers for nodes of all packages: the inbox, connections, conversions of common messages."""
