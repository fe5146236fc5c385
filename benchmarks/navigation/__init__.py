"""Filters, safety bubbles, the quality monitor and inertial navigation."""
