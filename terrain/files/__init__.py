"""Elevation files: formats, their parts, posts placed in metres, DEMs larger than memory."""
