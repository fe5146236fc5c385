"""Kernels of the receiver: samples in, sums out."""
