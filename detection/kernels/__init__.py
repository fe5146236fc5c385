"""Compiled kernels of the detector: numbers and contiguous arrays in, numbers and codes out."""
