"""Kernels of planning."""
