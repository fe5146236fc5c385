"""Systematic faults of a set of ranges: recognised, named, with their size; calibration of offset and scale."""
