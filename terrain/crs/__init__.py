"""Coordinate reference systems: what a file says, what a user says, metres of a grid and degrees of a body."""
