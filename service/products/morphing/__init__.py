"""Morphing maps: above which altitude positioning is good enough."""
