"""Vertical datums: what heights count from, geoid models, and heights brought from one datum to another."""
