"""Dilution of precision and position errors, at points and as maps."""
