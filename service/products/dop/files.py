"""The files of DOP maps: rasters, zones, the table along a trajectory, and the list of all."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from service.files.csv_table import TableWriter
from service.files.geojson import write_contours, write_no_go_zones
from service.files.layer import COG, GEOJSON, JSON, PNG, Layer
from service.parts.map_facts import altitude_datum_of
from service.products.in_common import BYTES, Drawn, Later, Raster, common_tags, write_cog
from visibility import UNKNOWN
from visibility.dilution import DopReason

from .calculate import PATH_COLUMNS, FinishedDopMap
from .request import MOST_CUTS

__all__ = ["LAYERS"]

CSV = "text/csv; charset=utf-8"
SIGMAS = ["horizontal sigma", "vertical sigma", "position sigma"]
GEOTIFF = "image/tiff; application=geotiff"


def write_count(finished: FinishedDopMap, path: Path) -> None:
    """Anchors surely in sight; the largest value (nodata) where the visible set is unknown."""
    small = len(finished.anchors) < 255
    dtype = np.uint8 if small else np.uint16
    nodata = int(np.iinfo(dtype).max)
    count = np.where(finished.reasons == DopReason.UNKNOWN, nodata, finished.count).astype(dtype)
    tags = {**_tags(finished), "units": "anchors"}
    write_cog(path, finished.grid, [count], ["visible anchors"], nodata, tags, BYTES)


def write_path(finished: FinishedDopMap, path: Path) -> None:
    """One line per point: PATH_COLUMNS, reason in words, and the ids in sight, with spaces between."""
    ids = [anchor.id for anchor in finished.anchors]
    bits = np.unpackbits(finished.path_sets.astype("<u8").view(np.uint8), axis=1, bitorder="little")[:, : len(ids)]
    reason, whole = (
        PATH_COLUMNS.index("reason"),
        (PATH_COLUMNS.index("anchors_in_sight"), PATH_COLUMNS.index("unknown")),
    )
    with path.open("w", encoding="utf-8", newline="") as file:
        table, datum = TableWriter(file, end="\r\n"), altitude_datum_of(finished.grid)
        table.row([*PATH_COLUMNS, "ids_in_sight", *datum])
        for numbers, seen in zip(finished.path_numbers.tolist(), bits, strict=True):
            cells: list[str] = [f"{number:.10g}" for number in numbers]
            cells[reason] = DopReason(int(numbers[reason])).name.lower()
            for column in whole:
                cells[column] = str(int(numbers[column]))
            in_sight = " ".join(ids[number] for number in np.flatnonzero(seen))
            table.row([*cells, in_sight, *datum.values()])


def _tags(finished: FinishedDopMap) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished.grid, finished.answer, "sightline DOP map"),
        "receiver": f"{parameters.receiver_above_ground_m:g} m above ground",
        "kind": parameters.kind,
        "measure": parameters.measure + (" along the surface" if parameters.on_surface else ""),
        "dop_limit": f"{parameters.dop_limit:g}",
    }


def _error_tags(finished: FinishedDopMap) -> dict[str, str]:
    return {**_tags(finished), "one sigma of a range": finished.answer.sigmas}


LAYERS = (
    Layer(
        "dop.tif",
        COG,
        "float32: the dilution of precision asked for; +inf no fix, NaN (nodata) unknown.",
        Raster(
            *(_tags, lambda finished: [finished.dop], lambda finished: [finished.parameters.measure]),
            *("1", math.nan, "no fix"),
        ),
    ),
    Layer(
        "count.tif",
        COG,
        "How many anchors are surely in sight, nodata (largest value) where that is unknown.",
        write_count,
    ),
    Layer(
        "position_error.tif",
        COG,
        "float32 metres, one sigma: position error horizontally, vertically and in space, from the sigmas of ranges "
        "and poses; +inf no fix, NaN (nodata) unknown.",
        Raster(_error_tags, lambda finished: finished.sigmas_m, lambda _: SIGMAS, "metre", infinity="no fix"),
    ),
    Layer(
        "no_go.tif",
        COG,
        "uint8: 1 where the dilution is the limit or more, or too few anchors are in sight; 0 elsewhere; 255 (nodata) "
        "unknown.",
        Raster(
            *(_tags, lambda finished: [finished.no_go], lambda _: ["no-go"]),
            *("class: 1 no-go, 0 go, 255 unknown", int(UNKNOWN)),
        ),
    ),
    Layer(
        "no_go.geojson",
        GEOJSON,
        "Polygons round the posts of no_go.tif that are 1, with their area.",
        lambda finished, path: write_no_go_zones(finished.grid, finished.no_go, finished.parameters, path),
    ),
    Layer(
        "contours.geojson",
        GEOJSON,
        "Lines along which the dilution is the limit, half of it and twice as much.",
        lambda finished, path: write_contours(finished.grid, finished.dop, finished.parameters, path),
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the dilution over shaded relief, with the line of the limit, anchors and legend.",
        Drawn("service.products.dop.picture:draw_dop_map"),
    ),
    Layer(
        "overlay.png",
        PNG,
        "The colours of map.png alone, from corner to corner of the DEM's cells; clear where no ground is known.",
        Later("service.products.dop.picture:write_overlay"),
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "What the colours mean: label, colour #rrggbb, known posts and their share 0..1 of each class.",
        Later("service.products.dop.picture:write_legend"),
        for_screens=True,
    ),
    Layer(
        "path.csv",
        CSV,
        "A line for each point of the path: metres, ids in sight, dilutions, one-sigma position errors in metres.",
        write_path,
        needs="path",
    ),
    *(
        Layer(
            f"cut-{number}.png",
            PNG,
            f"A picture of cut {number}: anchors in sight and the dilution, with the ground.",
            Drawn("service.products.dop.picture:draw_cut", {"number": number - 1}),
            needs="cuts",
            at_least=number,
        )
        for number in range(1, MOST_CUTS + 1)
    ),
    Layer(
        "volume_dop.tif",
        GEOTIFF,
        "float32, a band for each layer of the volume, the lowest first: the dilution; +inf no fix, NaN (nodata) "
        "unknown.",
        Later("service.products.dop.volume_files:write_volume_dop"),
        needs="volume",
    ),
    Layer(
        "volume_count.tif",
        GEOTIFF,
        "A band for each layer of the volume: how many anchors are surely in sight, nodata (largest value) where that "
        "of some is unknown.",
        Later("service.products.dop.volume_files:write_volume_count"),
        needs="volume",
    ),
    Layer(
        "volume.npz",
        "application/x-npz",
        "Arrays over layers, rows and columns for numpy: dilution, count, and the visible set as bits, anchor a being "
        "bit a % 64 of word a // 64.",
        Later("service.products.dop.volume_files:write_volume_arrays"),
        needs="volume",
    ),
    Layer(
        "volume.nc",
        "application/x-netcdf",
        "The same as NetCDF with coordinates and CRS, as xarray opens it.",
        Later("service.products.dop.volume_files:write_volume_dataset"),
        needs="volume",
    ),
)
