"""Planned paths for the programs that drive them: GPX tracks and QGroundControl missions."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import gpxpy.gpx

from service.files.missions import above_sea_level
from service.files.qgroundcontrol import ROVER, WAYPOINT, PlanItem, plan_text
from service.parts.map_facts import dem_name
from service.products.paths.calculate import FinishedPath
from terrain import to_lon_lat

__all__ = ["write_gpx", "write_plan"]

# GPX knows moments and no durations: a track without a date of its own begins here
BEGIN = datetime(1970, 1, 1, tzinfo=UTC)


def write_gpx(finished: FinishedPath, path: Path) -> None:
    """GPX 1.1: every vertex as a track, its times counted from 1970-01-01T00:00:00Z; the corners as a route.

    Elevations in it count from mean sea level: a DEM whose heights count from an ellipsoid has none to give.
    Raises FrameError for a DEM without CRS.
    """
    above_sea = above_sea_level(finished.grid)
    gpx = gpxpy.gpx.GPX()
    gpx.creator = f"Sightline {finished.calculation.version}"
    gpx.name = f"Path over {dem_name(finished.grid)}"
    gpx.description = finished.answer["sentence"]
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


def write_plan(finished: FinishedPath, path: Path) -> None:
    """A way-point for each corner, for a ground vehicle: above sea level, or else on the ground. Raises FrameError."""
    vertices = _vertices(finished)
    items = [PlanItem(WAYPOINT, *vertices[corner][:3]) for corner in finished.corners.tolist()]
    on_ground = not above_sea_level(finished.grid)
    if on_ground:
        items = [replace(item, altitude_m=0.0) for item in items]
    speed_m_per_s = finished.parameters.rover.speed_m_per_s
    speeds = {"cruise_m_per_s": speed_m_per_s, "hover_m_per_s": speed_m_per_s}
    text = plan_text(items, items[0], vehicle=ROVER, above_ground=on_ground, **speeds)
    path.write_text(text, encoding="utf-8")


def _vertices(finished: FinishedPath) -> list[tuple[float, float, float, float]]:
    """(lon_deg, lat_deg, altitude_m, time_s) of each vertex, degrees to a millimetre."""
    lon_deg, lat_deg = to_lon_lat(finished.grid, finished.column("east_m"), finished.column("north_m"))
    rows = zip(
        lon_deg.round(8).tolist(),
        lat_deg.round(8).tolist(),
        finished.column("altitude_m").round(2).tolist(),
        finished.column("time_s").tolist(),
        strict=True,
    )
    return list(rows)
