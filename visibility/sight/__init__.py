"""Anchors to minimum visible altitudes, lines of sight and profiles."""
