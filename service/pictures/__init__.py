"""Maps that a person can read."""

from .dop_picture import draw_dop_map, write_dop_picture
from .map_picture import draw_map, write_map_picture
from .morphing_picture import draw_morphing_map, write_morphing_picture
from .verdict_picture import draw_verdicts, write_verdict_picture

__all__ = [
    "draw_dop_map",
    "draw_map",
    "draw_morphing_map",
    "draw_verdicts",
    "write_dop_picture",
    "write_map_picture",
    "write_morphing_picture",
    "write_verdict_picture",
]
