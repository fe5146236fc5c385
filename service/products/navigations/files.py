"""The files of a navigated drive: the track as table, GeoJSON, GPX and arrays, innovations, pictures."""

from __future__ import annotations

import json
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np

from navigation import Verdict
from navigation.drives import SOURCES
from service.files.csv_table import TableWriter
from service.files.geojson import coordinates_of, feature, write_collection
from service.files.layer import GEOJSON, JSON, PNG, Layer
from service.files.mission_files import MISSIONS, above_sea_level, sea_level_m
from service.parts.map_facts import altitude_datum_of, dem_name
from service.products.in_common import Drawn

from .calculate import FinishedNavigation

__all__ = ["LAYERS"]

CSV = "text/csv; charset=utf-8"
BEGIN = datetime(1970, 1, 1, tzinfo=UTC)
(GPX,) = MISSIONS["navigation"]


def _write_json(finished: FinishedNavigation, path: Path) -> None:
    path.write_text(json.dumps(finished.points, allow_nan=False), encoding="utf-8")


def _write_csv(finished: FinishedNavigation, path: Path) -> None:
    datum = altitude_datum_of(finished.grid)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = TableWriter(file, end="\r\n")
        table.row([*finished.numbers(), *datum])
        for point in finished.points:
            table.row([*point.values(), *datum.values()])


def _write_geojson(finished: FinishedNavigation, path: Path) -> None:
    """The way as a line, then its places as points, in longitude, latitude and altitude."""
    grid = finished.grid
    places = coordinates_of(grid, finished.drive.place_m[finished.rows])
    line = feature("LineString", places, {"way_m": finished.answer.way_m}, "way")
    points = [
        feature("Point", place, {name: value for name, value in point.items() if name not in ("east_m", "north_m")})
        for place, point in zip(places, finished.points, strict=True)
    ]
    write_collection(grid, [*([line] if len(places) > 1 else []), *points], path)


def _write_gpx(finished: FinishedNavigation, path: Path) -> None:
    """GPX 1.1: a track whose times count from 1970-01-01T00:00:00Z, above mean sea level where that is known.

    Raises FrameError for a DEM without CRS.
    """
    import gpxpy.gpx  # takes a tenth of a second to load

    grid, places = finished.grid, finished.drive.place_m[finished.rows]
    ups: list[float | None] = [None] * len(places)
    if above_sea_level(grid):
        ups = list(sea_level_m(grid, *places.T).tolist())
    segment = gpxpy.gpx.GPXTrackSegment()
    for (lon_deg, lat_deg, _), up_m, time_s in zip(
        coordinates_of(grid, places), ups, finished.drive.track.times_s[finished.rows].tolist(), strict=True
    ):
        moment = BEGIN + timedelta(seconds=round(time_s, 3))
        segment.points.append(gpxpy.gpx.GPXTrackPoint(lat_deg, lon_deg, up_m, moment))
    track, gpx = gpxpy.gpx.GPXTrack(), gpxpy.gpx.GPX()
    track.segments.append(segment)
    gpx.creator = f"Sightline {finished.answer.version}"
    gpx.name = f"Drive over {dem_name(grid)}"
    gpx.tracks.append(track)
    path.write_text(gpx.to_xml(version="1.1"), encoding="utf-8")


def _write_innovations(finished: FinishedNavigation, path: Path) -> None:
    track = finished.drive.track
    measured, found = track.measurements, track.filtered
    with path.open("w", newline="", encoding="utf-8") as file:
        table = TableWriter(file, end="\r\n")
        table.row(["time_s", "source", "row", "innovation", "sigma", "verdict"])
        words = {int(verdict): verdict.name.lower().replace("_", " ") for verdict in Verdict}
        for time_s, source, row, innovation, variance, verdict in zip(
            measured.times_s.tolist(),
            measured.source.tolist(),
            measured.row.tolist(),
            found.innovation.tolist(),
            np.sqrt(found.innovation_variance).tolist(),
            found.verdict.tolist(),
            strict=True,
        ):
            told = ["" if value != value else round(value, 6) for value in (innovation, variance)]
            table.row([time_s, SOURCES[source], row, *told, words[verdict]])


def _write_npz(finished: FinishedNavigation, path: Path) -> None:
    drive, track = finished.drive, finished.drive.track
    filtered, step = track.filtered, track.reading[finished.rows]
    with path.open("wb") as file:
        np.savez(
            file,
            allow_pickle=False,
            **finished.numbers(),
            covariance_m2=drive.covariance_m2[finished.rows],
            sigmas=track.sigmas[finished.rows],
            force_bias_m_per_s2=filtered.force_bias_m_per_s2[step],
            rate_bias_rad_per_s=filtered.rate_bias_rad_per_s[step],
            force_scale=filtered.force_scale[step],
            rate_scale=filtered.rate_scale[step],
        )


LAYERS = (
    Layer("points.json", JSON, "Every place, in the order of time.", _write_json),
    Layer("track.csv", CSV, "The same as a table.", _write_csv),
    Layer("track.geojson", GEOJSON, "The way and its places in longitude, latitude and altitude.", _write_geojson),
    Layer(
        "track.gpx",
        "application/gpx+xml",
        "The way as a GPX 1.1 track. On Earth; without altitudes where nobody knows what the DEM's count from.",
        _write_gpx,
        mission=GPX,
    ),
    Layer(
        "track.npz",
        "application/x-npz",
        "The same as arrays for numpy, with covariances, sigmas of the error state, biases and scale factors.",
        _write_npz,
    ),
    Layer("innovations.csv", CSV, "What became of each measurement: measured less foretold.", _write_innovations),
    Layer("map.png", PNG, "The way on the map.", Drawn("service.products.navigations.picture:draw_track")),
    Layer(
        "errors.png",
        PNG,
        "Sigmas of place, velocity and attitude, and the biases that were found, over time.",
        Drawn("service.products.navigations.picture:draw_errors"),
    ),
    Layer(
        "innovations.png",
        PNG,
        "Innovations of each kind of measurement over time, with three of their sigmas.",
        Drawn("service.products.navigations.picture:draw_innovations"),
    ),
)
