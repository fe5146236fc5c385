"""Kernels of maps of sites."""
