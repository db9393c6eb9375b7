"""Whole fleets in one process on virtual time, from fleet files, maps and worlds."""
