"""How well and how fast the receiver works."""
