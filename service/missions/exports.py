"""Anchors and drawn shapes of a mission as files of other programs, each with its own frames and datums."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, dataclass
from pathlib import Path

import gpxpy.gpx
import numpy as np
import numpy.typing as npt
import shapely

from service.errors import RequestError
from service.files.csv_table import TableWriter
from service.files.geojson import Feature, coordinates_of, feature, write_collection
from service.files.mission_files import COPTER, WAYPOINT, PlanItem, above_sea_level, plan_text, sea_level_m
from service.missions.document import MissionAnchor, MissionIn, MissionPlace
from terrain import (
    ElevationGrid,
    VerticalDatumError,
    altitude_step,
    height_at,
    parse_vertical_datum,
    to_lon_lat,
    vertical_datum_of,
)

__all__ = [
    "AnchorRow",
    "anchor_rows",
    "write_csv",
    "write_geojson",
    "write_gpx",
    "write_kml_of",
    "write_kmz",
    "write_plan",
    "write_rows",
]

Floats = npt.NDArray[np.float64]
ZIP_TIME = (2020, 1, 1, 0, 0, 0)
ELLIPSOID = parse_vertical_datum("hae")
TOLD = {"kind", "ranging_sigma_m", "max_range_m", "azimuth_from_deg", "azimuth_to_deg", "radio"}
NO_GO, KEEP_IN, AREA, WAY = "#c1121f", "#17663a", "#0b5cad", "#111111"


@dataclass(frozen=True, slots=True)
class AnchorRow:
    """An anchor in every frame; None where nobody knows.

    ground_m, altitude_m: in the DEM's vertical datum. msl_m, ellipsoid_m: above mean sea level and WGS 84's ellipsoid.
    """

    id: str
    kind: str
    east_m: float
    north_m: float
    lon_deg: float | None
    lat_deg: float | None
    ground_m: float | None
    above_ground_m: float | None
    altitude_m: float | None
    msl_m: float | None
    ellipsoid_m: float | None
    max_range_m: float | None
    azimuth_from_deg: float | None
    azimuth_to_deg: float | None
    ranging_sigma_m: float
    radio: str | None


def anchor_rows(mission: MissionIn, grid: ElevationGrid) -> list[AnchorRow]:
    """Every anchor of a mission. Raises FrameError for places that the grid's CRS cannot express."""
    if not mission.anchors:
        return []
    places_m = np.array([(one.east_m, one.north_m) for one in mission.anchors])
    ground_m = height_at(grid, places_m[:, 0], places_m[:, 1])
    given_m = np.array([one.height_m for one in mission.anchors])
    from_ground = np.array([one.height_from == "above_ground_m" for one in mission.anchors])
    altitude_m = np.where(from_ground, ground_m + given_m, given_m)
    degrees = None if grid.crs is None else np.column_stack(to_lon_lat(grid, places_m[:, 0], places_m[:, 1]))
    msl_m, ellipsoid_m = (_above(grid, places_m, altitude_m, where) for where in ("msl", "hae"))
    above_m = np.where(from_ground, given_m, altitude_m - ground_m)
    return [
        AnchorRow(
            id=anchor.id,
            kind=anchor.kind,
            east_m=anchor.east_m,
            north_m=anchor.north_m,
            lon_deg=None if degrees is None else round(float(degrees[number, 0]), 8),
            lat_deg=None if degrees is None else round(float(degrees[number, 1]), 8),
            ground_m=_rounded(ground_m[number]),
            above_ground_m=_rounded(above_m[number]),
            altitude_m=_rounded(altitude_m[number]),
            msl_m=_rounded(msl_m[number]),
            ellipsoid_m=_rounded(ellipsoid_m[number]),
            max_range_m=anchor.max_range_m,
            azimuth_from_deg=anchor.azimuth_from_deg,
            azimuth_to_deg=anchor.azimuth_to_deg,
            ranging_sigma_m=anchor.ranging_sigma_m,
            radio=anchor.radio,
        )
        for number, anchor in enumerate(mission.anchors)
    ]


def _above(grid: ElevationGrid, places_m: Floats, altitude_m: Floats, datum: str) -> Floats:
    """Altitudes above that datum; NaN where no model tells."""
    own = vertical_datum_of(grid)
    try:
        if own is None:
            return np.full(len(altitude_m), np.nan)
        if datum == "msl":
            return sea_level_m(grid, places_m[:, 0], places_m[:, 1], altitude_m)
        step_m, _ = altitude_step(grid, places_m[:, 0], places_m[:, 1], given=own, wanted=ELLIPSOID)
    except VerticalDatumError:
        # not on the Earth, or no geoid model here: the column stays empty
        return np.full(len(altitude_m), np.nan)
    return np.asarray(altitude_m + step_m)


def _rounded(metres: float) -> float | None:
    return round(float(metres), 3) if np.isfinite(metres) else None


def write_rows(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """Every anchor in every frame, as JSON, and what its altitudes count from."""
    rows = [asdict(row) for row in anchor_rows(mission, grid)]
    path.write_text(json.dumps({"vertical_datum": grid.vertical_datum, "anchors": rows}, indent=1), encoding="utf-8")


def write_csv(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """A row per anchor: as --anchors and the planner read it."""
    names = ["id", "kind", "east_m", "north_m", "above_ground_m", "altitude_m", "ranging_sigma_m", "max_range_m"]
    names += ["azimuth_from_deg", "azimuth_to_deg", "radio"]
    rows = [{**anchor.model_dump(), anchor.height_from: anchor.height_m} for anchor in mission.anchors]
    with path.open("w", encoding="utf-8", newline="") as file:
        TableWriter(file).rows(names, [{key: value for key, value in row.items() if value is not None} for row in rows])


def write_geojson(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """Anchors, route and areas, in degrees; without a CRS in the grid's metres."""
    features = [
        feature("Point", _flat(grid, [one])[0], {**_told(one), one.height_from: one.height_m}, one.id)
        for one in mission.anchors
    ]
    features += [_shape_of(grid, name, what, places, kind) for name, what, places, kind in _shapes(mission)]
    write_collection(grid, features, path)


def _shape_of(grid: ElevationGrid, name: str, what: str, places: list[MissionPlace], kind: str) -> Feature:
    flat = _flat(grid, places)
    coordinates = [[*flat, flat[0]]] if kind == "Polygon" else flat
    return feature(kind, coordinates, {"what": what}, name)


def _flat(grid: ElevationGrid, places: list[MissionPlace] | list[MissionAnchor]) -> list[list[float]]:
    return coordinates_of(grid, np.array([(one.east_m, one.north_m) for one in places]))


def write_kml_of(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """Anchors, route and areas in folders. Raises FrameError for a grid without CRS."""
    from service.files.kml import ANCHORS, Mark, anchor_mark, write_kml  # its library takes a while to load

    marks = [
        anchor_mark(grid, row.id, (row.east_m, row.north_m, row.altitude_m), row.above_ground_m, _told_in_kml(anchor))
        if row.altitude_m is not None
        else Mark(row.id, shapely.Point(row.east_m, row.north_m), told=_told_in_kml(anchor))
        for row, anchor in zip(anchor_rows(mission, grid), mission.anchors, strict=True)
    ]
    colours = {"no-go": NO_GO, "keep-in": KEEP_IN, "area": AREA, "route": WAY}
    drawn = [
        Mark(name, _geometry(places, kind), told={"what": what}, colour=colours[what])
        for name, what, places, kind in _shapes(mission)
    ]
    write_kml(grid, mission.name, {ANCHORS: marks, "Route and areas": drawn}, path)


def write_kmz(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """The same, packed."""
    document = path.with_name("doc.kml")
    write_kml_of(mission, grid, document)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("doc.kml", ZIP_TIME), document.read_bytes(), zipfile.ZIP_DEFLATED)
    document.unlink()


def _geometry(places: list[MissionPlace], kind: str) -> shapely.Geometry:
    pairs = [(one.east_m, one.north_m) for one in places]
    return shapely.Polygon(pairs) if kind == "Polygon" else shapely.LineString(pairs)


def _shapes(mission: MissionIn) -> list[tuple[str, str, list[MissionPlace], str]]:
    """(name, what it is, its places, kind of geometry) of all that is drawn."""
    route = mission.route
    way = [one for one in (route.start, *route.way_points, route.goal) if one is not None]
    found = [("route", "route", way, "LineString")] if len(way) > 1 else []
    found += [] if mission.area is None else [("area", "area", mission.area, "Polygon")]
    found += [(f"no-go {number}", "no-go", ring, "Polygon") for number, ring in enumerate(route.no_go, 1)]
    return found + [(f"keep-in {number}", "keep-in", ring, "Polygon") for number, ring in enumerate(route.keep_in, 1)]


def write_gpx(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """Anchors as way-points, above mean sea level where that is known, and the route. Raises FrameError."""
    gpx = gpxpy.gpx.GPX()
    gpx.creator, gpx.name = "Sightline", mission.name
    for row in anchor_rows(mission, grid):
        lon_deg, lat_deg = to_lon_lat(grid, row.east_m, row.north_m)
        gpx.waypoints.append(
            gpxpy.gpx.GPXWaypoint(round(lat_deg, 8), round(lon_deg, 8), row.msl_m, name=row.id, type=row.kind)
        )
    for name, what, places, _ in _shapes(mission):
        if what == "route":
            route = gpxpy.gpx.GPXRoute(name=name)
            for lon_deg, lat_deg, *_ in _flat(grid, places):
                route.points.append(gpxpy.gpx.GPXRoutePoint(lat_deg, lon_deg))
            gpx.routes.append(route)
    path.write_text(gpx.to_xml(version="1.1"), encoding="utf-8")


def write_plan(mission: MissionIn, grid: ElevationGrid, path: Path) -> None:
    """A way-point for each anchor: above sea level, or above the ground where no sea level is known.

    Raises FrameError, RequestError: no anchors, or over unknown ground.
    """
    on_ground = not above_sea_level(grid)
    items = []
    for row in anchor_rows(mission, grid):
        up_m = row.above_ground_m if on_ground else row.msl_m
        if up_m is None:
            raise VerticalDatumError(
                f"Anchor {row.id} stands over unknown ground, so a plan cannot say how high it is."
            )
        lon_deg, lat_deg = to_lon_lat(grid, row.east_m, row.north_m)
        items.append(PlanItem(WAYPOINT, round(lon_deg, 8), round(lat_deg, 8), up_m))
    if not items:
        raise RequestError("The mission has no anchors, so there is nothing to plan a flight to.")
    path.write_text(plan_text(items, items[0], vehicle=COPTER, above_ground=on_ground), encoding="utf-8")


def _told(anchor: MissionAnchor) -> dict[str, object]:
    told = anchor.model_dump(include=TOLD)
    return {name: value for name, value in told.items() if value is not None}


def _told_in_kml(anchor: MissionAnchor) -> dict[str, object]:
    """The same, and how its height was given: the geometry has but an altitude, and in centimetres."""
    return {**_told(anchor), "height_m": anchor.height_m, "height_from": anchor.height_from}
