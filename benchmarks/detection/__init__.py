"""The detector on real and made-up ranges, with a map and without."""
