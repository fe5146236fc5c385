"""Compiled loops of inertial navigation."""
