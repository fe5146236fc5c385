"""Kernels of targets: numbers and arrays in, arrays out."""
