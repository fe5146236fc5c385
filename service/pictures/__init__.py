"""Maps that a person can read."""

from .map_picture import draw_map, write_map_picture

__all__ = ["draw_map", "write_map_picture"]
