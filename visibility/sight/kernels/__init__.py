"""Compiled kernels: numbers and contiguous arrays in, arrays and codes out; their public twin validates once."""
