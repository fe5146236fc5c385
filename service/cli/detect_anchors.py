"""Anchors of a detector, as --anchor texts and the anchor files of the other commands give them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from detection import DetectionInputError, RangingAnchor
from gnss import Place, ecef_to_enu_m, place_ecef_m
from service.errors import RequestError
from service.parts.anchors import AnchorIn

from .anchor_files import anchors_from_file
from .anchor_texts import FORM, anchor_from_text

__all__ = ["ranging_anchors"]


def ranging_anchors(
    texts: list[str], files: list[Path], *, level: bool
) -> tuple[list[RangingAnchor], dict[str, float] | None]:
    """The anchors of all options, in one level metric frame, and where on Earth that is if they came in degrees.

    level: heights do not matter. Raises RequestError.
    """
    asked = [_from_text(text, level) for text in texts]
    asked += [anchor for path in files for anchor in anchors_from_file(path, level=level)]
    if not asked:
        raise RequestError("At least one anchor is needed: --anchor ID,EAST,NORTH,612msl or --anchors FILE.")
    twice = sorted(anchor_id for anchor_id, count in Counter(anchor.id for anchor in asked).items() if count > 1)
    if twice:
        raise RequestError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
    datums = sorted({anchor.altitude_datum for anchor in asked if anchor.altitude_datum is not None})
    if len(datums) > 1 and not level:
        raise RequestError(
            f"Heights of a detector's anchors count from one datum, not from {' and '.join(datums)}: give all as msl, "
            "or all as hae."
        )
    in_degrees = [anchor for anchor in asked if anchor.lon_deg is not None]
    if not in_degrees:
        return [_ranging(anchor, level) for anchor in asked], None
    if len(in_degrees) < len(asked):
        metric = next(anchor for anchor in asked if anchor.lon_deg is None)
        raise RequestError(
            f"Anchor {in_degrees[0].id} is in degrees and {metric.id} in metres; a detector takes all in one frame."
        )
    return _in_local_frame(asked, level)


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


def _in_local_frame(asked: Sequence[AnchorIn], level: bool) -> tuple[list[RangingAnchor], dict[str, float]]:
    """Anchors in degrees as east, north, up of the place amid them, straight as ranges are: no map's scale is in it.

    Up counts from sea level, or from whatever altitudes count from, at that place.
    """
    degrees = np.array([(anchor.lon_deg, anchor.lat_deg) for anchor in asked], np.float64)
    heights_m = np.array([0.0 if level else _altitude_m(anchor) for anchor in asked])
    if np.ptp(degrees[:, 0]) > 180.0:
        degrees[:, 0] %= 360.0  # they lie on both sides of the antimeridian
    lon_deg, lat_deg = (float(mean) for mean in degrees.mean(axis=0))
    middle = Place(lon_deg, lat_deg, float(heights_m.mean()))
    places = zip(degrees.tolist(), heights_m.tolist(), strict=True)
    at_ecef_m = np.array([place_ecef_m(Place(lon, lat, up_m)) for (lon, lat), up_m in places])
    enu_m = ecef_to_enu_m(middle, at_ecef_m)
    ups_m = np.zeros(len(asked)) if level else enu_m[:, 2] + middle.height_m
    anchors = [
        _made(anchor, east_m, north_m, altitude_m)
        for anchor, (east_m, north_m, _), altitude_m in zip(asked, enu_m.tolist(), ups_m.tolist(), strict=True)
    ]
    return anchors, {"lon_deg": (lon_deg + 180.0) % 360.0 - 180.0, "lat_deg": lat_deg}


def _altitude_m(anchor: AnchorIn) -> float:
    if anchor.altitude_m is None:
        raise RequestError(f"Anchor {anchor.id}: a detector knows no ground; give altitude_m (612msl).")
    return anchor.altitude_m


def _ranging(anchor: AnchorIn, level: bool) -> RangingAnchor:
    if anchor.east_m is None or anchor.north_m is None:
        raise RequestError(f"Anchor {anchor.id}: a detector needs east_m and north_m, or lon_deg and lat_deg.")
    altitude_m = 0.0 if level and anchor.altitude_m is None else _altitude_m(anchor)
    return _made(anchor, anchor.east_m, anchor.north_m, altitude_m)


def _made(anchor: AnchorIn, east_m: float, north_m: float, altitude_m: float) -> RangingAnchor:
    try:
        return RangingAnchor(anchor.id, east_m, north_m, altitude_m, anchor.pose_sigma_m)
    except DetectionInputError as error:
        raise RequestError(str(error)) from error
