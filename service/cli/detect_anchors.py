"""Anchors of a detector, as --anchor texts and the anchor files of the other commands give them."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

from detection import DetectionInputError, RangingAnchor
from service.errors import RequestError
from service.schemas import AnchorIn

from .anchor_files import anchors_from_file
from .anchor_texts import FORM, anchor_from_text

__all__ = ["ranging_anchors"]


def ranging_anchors(texts: list[str], files: list[Path], *, level: bool) -> list[RangingAnchor]:
    """The anchors of all options, in one level metric frame. level: heights do not matter. Raises RequestError."""
    asked = [_from_text(text, level) for text in texts]
    asked += [anchor for path in files for anchor in anchors_from_file(path, level=level)]
    if not asked:
        raise RequestError("At least one anchor is needed: --anchor ID,EAST,NORTH,612msl or --anchors FILE.")
    anchors = [_ranging(anchor, level) for anchor in asked]
    ids = [anchor.id for anchor in anchors]
    twice = sorted(id for id, times in Counter(ids).items() if times > 1)
    if twice:
        raise RequestError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
    return anchors


def _from_text(text: str, level: bool) -> AnchorIn:
    if level and text.count(",") == 2:
        text = f"{text},0msl"
    try:
        return anchor_from_text(text, lonlat=False)
    except RequestError as error:
        if FORM in str(error):
            raise RequestError(
                f"--anchor {text!r} is not of the form ID,EAST,NORTH,HEIGHT with HEIGHT like 612msl."
            ) from error
        raise


def _ranging(anchor: AnchorIn, level: bool) -> RangingAnchor:
    if anchor.east_m is None or anchor.north_m is None:
        raise RequestError(f"Anchor {anchor.id}: a detector knows no map; give east_m and north_m in metres.")
    if anchor.altitude_m is None and not level:
        raise RequestError(f"Anchor {anchor.id}: a detector knows no ground; give altitude_m (612msl).")
    altitude_m = 0.0 if anchor.altitude_m is None else anchor.altitude_m
    try:
        return RangingAnchor(anchor.id, anchor.east_m, anchor.north_m, altitude_m, anchor.pose_sigma_m)
    except DetectionInputError as error:
        raise RequestError(str(error)) from error
