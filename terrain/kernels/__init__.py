"""Kernels over the triangulated surface: its heights, and how near it is."""

from .surface import resample_surface, settled, surface_height, surface_heights

__all__ = ["resample_surface", "settled", "surface_height", "surface_heights"]
