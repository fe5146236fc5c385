"""Cloud-optimised GeoTIFFs of DOP maps and of morphing maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from service.files.cog import BYTES, FLOATS, common_tags, write_cog
from service.products.dop.calculate import FinishedDopMap
from service.products.morphing.calculate import FinishedMorphingMap
from service.products.morphing.frames import AVAILABLE_BANDS, available_at, frame_words
from visibility import UNKNOWN, ColumnState, DopReason

__all__ = [
    "write_above_ground",
    "write_altitude",
    "write_availability",
    "write_count_of_dop",
    "write_dop",
    "write_flags",
    "write_frames_altitude",
    "write_frames_state",
    "write_no_go",
    "write_position_error",
]


def write_dop(finished: FinishedDopMap, path: Path) -> None:
    """float32: the dilution; NaN unknown (nodata), +inf no fix."""
    tags = {**_dop_tags(finished), "units": "1", "infinity": "no fix"}
    write_cog(path, finished.grid, [finished.dop], [finished.parameters.measure], float("nan"), tags, FLOATS)


def write_count_of_dop(finished: FinishedDopMap, path: Path) -> None:
    """Anchors surely in sight; the largest value (nodata) where the visible set is unknown."""
    small = len(finished.anchors) < 255
    dtype = np.uint8 if small else np.uint16
    nodata = int(np.iinfo(dtype).max)
    count = np.where(finished.reasons == DopReason.UNKNOWN, nodata, finished.count).astype(dtype)
    tags = {**_dop_tags(finished), "units": "anchors"}
    write_cog(path, finished.grid, [count], ["visible anchors"], nodata, tags, BYTES)


def write_position_error(finished: FinishedDopMap, path: Path) -> None:
    """float32 metres, one sigma: horizontal, vertical, position; NaN unknown (nodata), +inf no fix."""
    tags = {**_dop_tags(finished), "units": "metre", "infinity": "no fix"}
    names = ["horizontal sigma", "vertical sigma", "position sigma"]
    write_cog(path, finished.grid, finished.sigmas_m, names, float("nan"), tags, FLOATS)


def write_no_go(finished: FinishedDopMap, path: Path) -> None:
    """uint8: 1 no-go, 0 go, 255 unknown (nodata)."""
    tags = {**_dop_tags(finished), "units": "class: 1 no-go, 0 go, 255 unknown"}
    write_cog(path, finished.grid, [finished.no_go], ["no-go"], int(UNKNOWN), tags, BYTES)


def write_altitude(finished: FinishedMorphingMap, path: Path) -> None:
    """float32 metres: altitude above which all is flyable up to the ceiling; NaN (nodata) where there is none."""
    tags = {**_morphing_tags(finished), "units": "metre"}
    write_cog(path, finished.grid, [finished.altitude_m], ["flyable above"], float("nan"), tags, FLOATS)


def write_above_ground(finished: FinishedMorphingMap, path: Path) -> None:
    """float32 metres: the same as a height above the ground."""
    tags = {**_morphing_tags(finished), "units": "metre"}
    bands = [finished.above_ground_m]
    write_cog(path, finished.grid, bands, ["flyable above, over ground"], float("nan"), tags, FLOATS)


def write_flags(finished: FinishedMorphingMap, path: Path) -> None:
    """uint8: state of each column of air, and how many stretches of no-flight air it has."""
    tags = {**_morphing_tags(finished), "units": _states()}
    bands = (finished.state, finished.no_flight_intervals)
    # every value says something, also those of unknown air
    write_cog(path, finished.grid, bands, ["state", "no-flight intervals"], None, tags, BYTES)


def write_frames_altitude(finished: FinishedMorphingMap, path: Path) -> None:
    """float32 metres, a band per frame: NaN (nodata) where there is none."""
    tags = {**_morphing_tags(finished), "units": "metre"}
    bands = finished.frame_altitude_m
    write_cog(
        path, finished.grid, bands, frame_words(finished.parameters, finished.frame_sources), float("nan"), tags, FLOATS
    )


def write_frames_state(finished: FinishedMorphingMap, path: Path) -> None:
    """uint8, a band per frame: state of each column of air."""
    tags = {**_morphing_tags(finished), "units": _states()}
    write_cog(
        path,
        finished.grid,
        finished.frame_state,
        frame_words(finished.parameters, finished.frame_sources),
        None,
        tags,
        BYTES,
    )


def write_availability(finished: FinishedMorphingMap, path: Path) -> None:
    """float64: seconds of the first, last and longest availability, NaN (nodata) never; shares of the frames."""
    assert finished.parameters.frames is not None, "the layer needs frames"
    ((height, metres),) = available_at(finished.parameters, finished.parameters.frames).items()
    where = {"available_at": f"{height.removesuffix('_m').replace('_', ' ')} {metres:g} m"}
    tags = {**_morphing_tags(finished), **where, "units": "second; shares 0..1"}
    names = [name.replace("_", " ").removesuffix(" s") for name in AVAILABLE_BANDS]
    write_cog(path, finished.grid, finished.available, names, float("nan"), tags, FLOATS)


def _states() -> str:
    return "class: " + ", ".join(f"{state.value} {state.name.lower()}" for state in ColumnState)


def _dop_tags(finished: FinishedDopMap) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished, "sightline DOP map"),
        "receiver": f"{parameters.receiver_above_ground_m:g} m above ground",
        "kind": parameters.kind,
        "measure": parameters.measure + (" along the surface" if parameters.on_surface else ""),
        "dop_limit": f"{parameters.dop_limit:g}",
    }


def _morphing_tags(finished: FinishedMorphingMap) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished, "sightline morphing map"),
        "ceiling": finished.ceiling_words(),
        "kind": parameters.kind,
        "measure": parameters.measure,
        "dop_limit": f"{parameters.dop_limit:g}",
    }
