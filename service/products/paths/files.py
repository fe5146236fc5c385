"""The files of planned paths: GeoJSON with what holds at each vertex, a table, missions, pictures; the list of all."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import shapely

from service.files.csv_table import TableWriter
from service.files.geojson import Feature, coordinates_of, feature, place_of, write_collection
from service.files.layer import GEOJSON, KML, PNG, Layer
from service.files.mission_files import MISSIONS, ROVER, WAYPOINT, PlanItem, above_sea_level, plan_text, sea_level_m
from service.parts.map_facts import altitude_datum_of, dem_name
from service.parts.plan_answers import PathPlaceOut
from service.products.in_common import Drawn
from service.products.paths.answer import VERTEX_COLUMNS, FinishedPath, PathAreaOut
from terrain import height_at, to_lon_lat

__all__ = ["LAYERS"]

DECIMALS_M, DECIMALS = 3, 4
# told by the geometry
PLACE = ("east_m", "north_m")
# GPX knows moments and no durations: a track without a date of its own begins here
BEGIN = datetime(1970, 1, 1, tzinfo=UTC)
FOUND = "found"
NO_GO_COLOUR, KEEP_IN_COLOUR = "#c01818", "#2e9e4f"
GPX, PLAN, KML_OF_PATH = MISSIONS["path"]


def _write_geojson(finished: FinishedPath, path: Path) -> None:
    """A FeatureCollection in longitude, latitude and altitude; without a CRS in the DEM's local metres, and says so.

    A found path is one LineString, whose properties ``vertices`` hold what the points hold one by one.
    """
    features = [_line(finished), *_points(finished)] if finished.found else _blocked(finished)
    write_collection(finished.grid, features, path)


def _write_csv(finished: FinishedPath, path: Path) -> None:
    """A row per vertex, with the datum of its altitude; an empty cell is no number: no anchors, no fix, no bubble."""
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = [
            {"east_m": round(east_m, DECIMALS_M), "north_m": round(north_m, DECIMALS_M), **row}
            for east_m, north_m, row in zip(
                finished.column("east_m").tolist(),
                finished.column("north_m").tolist(),
                _vertex_properties(finished),
                strict=True,
            )
        ]
        for row in rows:
            row["visible_anchors"] = " ".join(row["visible_anchors"])
            row |= altitude_datum_of(finished.grid)
        TableWriter(file).rows(list(rows[0]), rows)


def _vertex_properties(finished: FinishedPath) -> list[dict[str, object]]:
    """What holds at each vertex, ready for JSON: angles in degrees, None where there is no number."""
    ids = np.array(finished.answer.ranged_to)
    columns: dict[str, list[object]] = {}
    for name in VERTEX_COLUMNS:
        if name in PLACE:
            continue
        values = finished.column(name)
        if name.endswith("_rad"):
            name, values = f"{name.removesuffix('_rad')}_deg", np.degrees(values)
        columns[name] = [round(value, DECIMALS) if math.isfinite(value) else None for value in values.tolist()]
    columns["anchor_count"] = finished.column("anchor_count").astype(int).tolist()
    columns["visible_anchors"] = [ids[row == 1].tolist() if len(ids) else [] for row in finished.visible]
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _line(finished: FinishedPath) -> Feature:
    answer = finished.answer
    assert answer.totals is not None, "a found path has totals"
    properties = {
        "what": "path",
        **answer.model_dump(
            mode="json", include={"status", "sentence", "cost", "cost_split", "reference_cost", "ratio"}
        ),
        **answer.totals.model_dump(),
        "corners": finished.corners.tolist(),
        "vertices": _vertex_properties(finished),
    }
    return feature("LineString", _coordinates(finished), properties)


def _write_alternatives(finished: FinishedPath, path: Path) -> None:
    """A FeatureCollection with a LineString per way, the path first; coordinates as in path.geojson."""
    grid, answer = finished.grid, finished.answer
    corners_m = [finished.vertices[finished.corners][:, [VERTEX_COLUMNS.index(name) for name in PLACE]]]
    corners_m += [np.array([(at.east_m, at.north_m) for at in one.corners]) for one in answer.alternatives]
    assert answer.totals is not None, "a found path has totals"
    told: list[dict[str, object]] = [{"what": "path", "cost": answer.cost, **answer.totals.model_dump()}]
    for one in answer.alternatives:
        numbers = one.model_dump(exclude={"totals", "corners"})
        told.append({**numbers, **one.totals.model_dump()})
    lines = [
        feature("LineString", coordinates_of(grid, np.column_stack([at, height_at(grid, *at.T)])), more)
        for at, more in zip(corners_m, told, strict=True)
    ]
    write_collection(grid, lines, path)


def _points(finished: FinishedPath) -> list[Feature]:
    places = _coordinates(finished)
    return [
        feature("Point", place, {"what": "vertex", "number": number, **properties})
        for number, (place, properties) in enumerate(zip(places, _vertex_properties(finished), strict=True))
    ]


def _blocked(finished: FinishedPath) -> list[Feature]:
    """Start and goals, and where the way is cut and by what."""
    answer = finished.answer
    cut = answer.unreachable
    named: list[tuple[str, PathPlaceOut | PathAreaOut, dict[str, object]]] = [
        ("start", answer.start, {}),
        *(("goal", goal, {}) for goal in answer.goals),
    ]
    if cut is not None:
        named.append(("blocked", cut.where, cut.model_dump(exclude={"where"})))
    return [
        feature(
            "Point",
            place_of(finished.grid, at.east_m, at.north_m),
            {"what": what, "status": answer.status, **more},
        )
        for what, at, more in named
    ]


def _coordinates(finished: FinishedPath) -> list[list[float]]:
    places = [finished.column(name) for name in ("east_m", "north_m", "altitude_m")]
    return coordinates_of(finished.grid, np.column_stack(places))


def _write_gpx(finished: FinishedPath, path: Path) -> None:
    """GPX 1.1: every vertex as a track, its times counted from 1970-01-01T00:00:00Z; the corners as a route.

    Elevations in it count from mean sea level: where nobody knows what the DEM's count from, there are none.
    Raises FrameError for a DEM without CRS.
    """
    import gpxpy.gpx  # takes a tenth of a second to load

    above_sea = above_sea_level(finished.grid)
    gpx = gpxpy.gpx.GPX()
    gpx.creator = f"Sightline {finished.answer.version}"
    gpx.name = f"Path over {dem_name(finished.grid)}"
    gpx.description = finished.answer.sentence
    track, segment, route = gpxpy.gpx.GPXTrack(), gpxpy.gpx.GPXTrackSegment(), gpxpy.gpx.GPXRoute()
    for lon_deg, lat_deg, up_m, seconds in _vertices(finished):
        moment = BEGIN + timedelta(seconds=round(seconds, 3))
        segment.points.append(gpxpy.gpx.GPXTrackPoint(lat_deg, lon_deg, up_m if above_sea else None, moment))
    for number, corner in enumerate(finished.corners.tolist()):
        point = segment.points[corner]
        route.points.append(
            gpxpy.gpx.GPXRoutePoint(point.latitude, point.longitude, point.elevation, name=f"C{number}")
        )
    track.segments.append(segment)
    gpx.tracks.append(track)
    gpx.routes.append(route)
    path.write_text(gpx.to_xml(version="1.1"), encoding="utf-8")


def _write_plan(finished: FinishedPath, path: Path) -> None:
    """A way-point for each corner, for a ground vehicle: above sea level, or on the ground. Raises FrameError."""
    vertices = _vertices(finished)
    items = [PlanItem(WAYPOINT, *vertices[corner][:3]) for corner in finished.corners.tolist()]
    on_ground = not above_sea_level(finished.grid) or finished.parameters.plan_altitudes == "ground"
    if on_ground:
        items = [replace(item, altitude_m=0.0) for item in items]
    speed_m_per_s = finished.parameters.rover.speed_m_per_s
    speeds = {"cruise_m_per_s": speed_m_per_s, "hover_m_per_s": speed_m_per_s}
    text = plan_text(items, items[0], vehicle=ROVER, above_ground=on_ground, **speeds)
    path.write_text(text, encoding="utf-8")


def _write_kml(finished: FinishedPath, path: Path) -> None:
    """The path on the ground, its corners, and the anchors above mean sea level. Raises FrameError."""
    from service.files.kml import ANCHORS, Mark, anchor_mark, area_marks, write_kml  # its library takes a while

    grid, answer, asked = finished.grid, finished.answer, finished.parameters
    places = np.column_stack([finished.column("east_m"), finished.column("north_m")])
    totals = {} if answer.totals is None else answer.totals.model_dump()
    told = {"status": answer.status.value, "sentence": answer.sentence, **totals}
    corners = [
        Mark(f"C{number}", shapely.Point(places[corner]), told={"time_s": round(float(time_s), 1)})
        for number, (corner, time_s) in enumerate(
            zip(finished.corners.tolist(), finished.column("time_s")[finished.corners], strict=True)
        )
    ]
    anchors = [
        anchor_mark(grid, one.id, (one.east_m, one.north_m, one.altitude_m), one.above_ground_m, {})
        for one in answer.anchors
    ]
    folders = {
        "Path": [Mark("path", shapely.LineString(places), told=told)],
        "Corners": corners,
        ANCHORS: anchors,
        "Areas": area_marks(grid, {"no_go": asked.no_go}, NO_GO_COLOUR)
        + area_marks(grid, {"keep_in": asked.keep_in}, KEEP_IN_COLOUR),
    }
    write_kml(grid, f"Path over {dem_name(grid)}", folders, path)


def _vertices(finished: FinishedPath) -> list[tuple[float, float, float, float]]:
    """(lon_deg, lat_deg, metres above sea level where known, time_s) of each vertex, degrees to a millimetre."""
    grid, places = finished.grid, (finished.column("east_m"), finished.column("north_m"))
    lon_deg, lat_deg = to_lon_lat(grid, *places)
    altitude_m = finished.column("altitude_m")
    if above_sea_level(grid):
        altitude_m = sea_level_m(grid, *places, altitude_m)
    rows = zip(
        lon_deg.round(8).tolist(),
        lat_deg.round(8).tolist(),
        altitude_m.round(2).tolist(),
        finished.column("time_s").tolist(),
        strict=True,
    )
    return list(rows)


LAYERS = (
    Layer(
        "path.geojson",
        GEOJSON,
        "The path as a LineString with totals, and each vertex as a point with what holds there; without a path the "
        "start, the goals and where the way is cut.",
        _write_geojson,
    ),
    Layer(
        "path.csv",
        "text/csv; charset=utf-8",
        "A row per vertex: metres in the DEM's CRS, degrees, seconds, anchors in sight, dilution, margin.",
        _write_csv,
        status=FOUND,
    ),
    Layer(
        "alternatives.geojson",
        GEOJSON,
        "The path and the other ways as LineStrings, with their totals and what each is worth.",
        _write_alternatives,
        needs="alternatives",
        status=FOUND,
    ),
    Layer(
        "path.gpx",
        "application/gpx+xml",
        "The path as a GPX 1.1 track with altitudes and seconds from its start, a route of its corners. On Earth; "
        "without altitudes where the DEM counts from an ellipsoid.",
        _write_gpx,
        status=FOUND,
        mission=GPX,
    ),
    Layer(
        "path.plan",
        "application/json",
        "The corners of the path as a QGroundControl mission for a rover. On Earth.",
        _write_plan,
        status=FOUND,
        mission=PLAN,
    ),
    Layer(
        "path.kml",
        KML,
        "The path on the ground and its corners as KML, areas, and the anchors above mean sea level; on Earth.",
        _write_kml,
        status=FOUND,
        mission=KML_OF_PATH,
    ),
    Layer(
        "map.png",
        PNG,
        "The path over shaded relief with the dilution of precision and the ground that may not be driven.",
        Drawn("service.products.paths.picture:draw_path"),
    ),
    Layer(
        "profile.png",
        PNG,
        "Height, slope, anchors in sight, dilution and clearances along the path.",
        Drawn("service.products.paths.profile:draw_profile"),
        status=FOUND,
    ),
)
