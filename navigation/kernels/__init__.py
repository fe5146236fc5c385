"""Compiled inner parts of navigation: the filter, covariances along a path, probabilities of spheres."""
