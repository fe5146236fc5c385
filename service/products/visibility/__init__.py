"""Visibility maps: which anchors are seen from where."""
