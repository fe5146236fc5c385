"""Paths and placements."""
