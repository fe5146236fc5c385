"""Lines of sight between pairs of points."""
