"""KML 2.2 written: what lies on the Earth, with altitudes that count from where KML's do, the EGM96 geoid."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, cast

import numpy as np
import numpy.typing as npt
import shapely
from fastkml import Data, Document, ExtendedData, Folder, LineStyle, Placemark, PolyStyle, Style, StyleUrl
from fastkml.enums import AltitudeMode
from fastkml.geometry import create_kml_geometry
from fastkml.kml import KML
from pygeoif import shape
from pygeoif.types import GeoInterface
from shapely.geometry import mapping

from service.files.geojson import Geometry, cut
from service.parts.map_facts import dem_name
from service.parts.points import PolygonIn
from service.parts.shapes_in_grid import polygon_in_grid
from terrain import (
    ElevationGrid,
    VerticalDatumError,
    altitude_step,
    parse_vertical_datum,
    to_lon_lat,
    vertical_datum_of,
)

__all__ = ["ANCHORS", "Mark", "anchor_mark", "area_marks", "write_kml"]

ANCHORS = "Anchors"
EGM96 = parse_vertical_datum("EGM96")
DECIMALS_DEG, DECIMALS_M = 8, 2
OPAQUE, FILL = "ff", "50"
INK = "#e6007e"
MODES = {
    "altitude": AltitudeMode.absolute,
    "above_ground": AltitudeMode.relative_to_ground,
    "on_ground": AltitudeMode.clamp_to_ground,
}


@dataclass(frozen=True, slots=True, eq=False)
class Mark:
    """A placemark: what it is called, where it is, and what is told of it.

    geometry: metres east and north in the grid's CRS; a third coordinate is what ``height`` says: an altitude in the
    grid's vertical datum, metres above the ground below, or nothing that counts. colour: #rrggbb of lines and fills.
    told: becomes ExtendedData. shown: whether viewers show it when the file is opened.
    """

    name: str
    geometry: shapely.Geometry
    height: Literal["altitude", "above_ground", "on_ground"] = "on_ground"
    told: Mapping[str, object] = field(default_factory=dict)
    colour: str = INK
    shown: bool = True


def anchor_mark(
    grid: ElevationGrid,
    name: str,
    at_m: tuple[float, float, float],
    above_ground_m: float | None,
    told: Mapping[str, object],
) -> Mark:
    """Something in the air or on a mast: at its altitude, or above the ground where no sea level is known.

    above_ground_m: None where the ground below is not known; without a sea level it then lies on the ground.
    """
    east_m, north_m, altitude_m = at_m
    about: dict[str, object] = {"id": name, **told}
    if vertical_datum_of(grid) is not None:
        return Mark(name, shapely.Point(east_m, north_m, altitude_m), "altitude", about)
    if above_ground_m is None:
        return Mark(name, shapely.Point(east_m, north_m), "on_ground", about)
    return Mark(name, shapely.Point(east_m, north_m, above_ground_m), "above_ground", about)


def area_marks(grid: ElevationGrid, areas: Mapping[str, Sequence[PolygonIn]], colour: str) -> list[Mark]:
    """Areas of a request, by the names of their fields. Raises RequestError, FrameError."""
    return [
        Mark(f"{name}[{number}]", polygon_in_grid(grid, area, name), colour=colour)
        for name, some in areas.items()
        for number, area in enumerate(some)
    ]


def write_kml(grid: ElevationGrid, title: str, folders: Mapping[str, Sequence[Mark]], path: Path) -> None:
    """Marks in folders of a document, by the folders' names; folders without marks are left out.

    Altitudes become metres above EGM96, as KML's absolute altitudes are; the document's description says from what.
    Raises FrameError for a grid without CRS, VerticalDatumError for altitudes of a grid of which nobody knows what they
    count from.
    """
    sentences: dict[str, None] = {}
    styles: dict[str, Style] = {}
    found = [
        Folder(name=name, features=[_placemark(grid, mark, styles, sentences) for mark in marks])
        for name, marks in folders.items()
        if marks
    ]
    told = " ".join((f"Made by Sightline over {dem_name(grid)}.", *sentences))
    document = Document(name=title, description=told, styles=list(styles.values()), features=found)
    text: str = KML(features=[document]).to_string(prettyprint=True)
    path.write_text(f'<?xml version="1.0" encoding="UTF-8"?>\n{text}', encoding="utf-8")


def _placemark(grid: ElevationGrid, mark: Mark, styles: dict[str, Style], sentences: dict[str, None]) -> Placemark:
    geometry = shapely.force_2d(mark.geometry) if mark.height == "on_ground" else mark.geometry
    in_degrees = shapely.transform(
        geometry, lambda places_m: _degrees(grid, places_m, mark.height, sentences), include_z=geometry.has_z
    )
    drawn = shape(cast(GeoInterface, cut(cast(Geometry, mapping(in_degrees)))))
    style = f"c{mark.colour.lstrip('#').lower()}"
    if style not in styles:
        red, green, blue = (mark.colour[n : n + 2] for n in (1, 3, 5))
        line, fill = (f"{opacity}{blue}{green}{red}".lower() for opacity in (OPAQUE, FILL))
        styles[style] = Style(id=style, styles=[LineStyle(color=line, width=2.5), PolyStyle(color=fill)])
    data = [Data(name=name, value=_word(value)) for name, value in mark.told.items() if value is not None]
    return Placemark(
        name=mark.name,
        visibility=mark.shown,
        style_url=_to(style),
        extended_data=ExtendedData(elements=data) if data else None,
        kml_geometry=create_kml_geometry(
            drawn,
            altitude_mode=MODES[mark.height],
            # a line on the ground follows it
            tessellate=True if mark.height == "on_ground" and "Point" not in drawn.geom_type else None,
            extrude=True if mark.height == "altitude" and drawn.geom_type == "Point" else None,
        ),
    )


def _degrees(
    grid: ElevationGrid, places_m: npt.NDArray[np.float64], height: str, sentences: dict[str, None]
) -> npt.NDArray[np.float64]:
    """(n, 2 or 3) longitude, latitude, and the third coordinate as KML means it."""
    east_m, north_m = places_m[:, 0], places_m[:, 1]
    found = [np.round(degrees, DECIMALS_DEG) for degrees in to_lon_lat(grid, east_m, north_m)]
    if places_m.shape[1] > 2:
        up_m = places_m[:, 2]
        if height == "altitude":
            step_m, told = _to_egm96(grid, east_m, north_m)
            up_m = up_m + step_m
            sentences.update(dict.fromkeys(told))
        found.append(np.round(up_m, DECIMALS_M))
    return np.column_stack(found)


def _to_egm96(
    grid: ElevationGrid, east_m: npt.NDArray[np.float64], north_m: npt.NDArray[np.float64]
) -> tuple[npt.NDArray[np.float64], tuple[str, ...]]:
    """(metres to add to altitudes in the grid's datum, what to know about them)."""
    own = vertical_datum_of(grid)
    if own is None:
        raise VerticalDatumError("Nobody knows how the DEM lies to mean sea level; read it with vertical_datum.")
    try:
        step_m, told = altitude_step(grid, east_m, north_m, given=own, wanted=EGM96)
    except VerticalDatumError as error:
        # two surfaces of gravity, some decimetres apart, and no model here that tells by how much
        as_they_are = f"Altitudes are those above {own.name}, taken for KML's mean sea level as they are: {error}"
        return np.zeros(len(east_m)), (as_they_are,)
    return step_m, (f"Altitudes are metres above EGM96 (mean sea level), from the DEM's {own.name}.", *told)


def _word(value: object) -> str:
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def _to(style: str) -> StyleUrl:
    return StyleUrl(url=f"#{style}")
