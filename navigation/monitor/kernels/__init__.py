"""Compiled loops of the quality monitor."""
