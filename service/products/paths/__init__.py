"""Paths on which the anchors stay in sight."""
