"""The files of DOP maps: rasters, zones, the table along a trajectory, and the list of all."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from service.files.geojson import write_contours, write_no_go_zones
from service.files.layer import COG, GEOJSON, JSON, PNG, Layer
from service.files.rasters import BYTES, FLOATS, common_tags, write_cog
from service.files.tables import TableWriter
from visibility import UNKNOWN, DopReason

from .calculate import PATH_COLUMNS, FinishedDopMap
from .request import MOST_CUTS

__all__ = ["LAYERS"]

CSV = "text/csv; charset=utf-8"
GEOTIFF = "image/tiff; application=geotiff"


def write_dop(finished: FinishedDopMap, path: Path) -> None:
    """float32: the dilution; NaN unknown (nodata), +inf no fix."""
    tags = {**_tags(finished), "units": "1", "infinity": "no fix"}
    write_cog(path, finished.grid, [finished.dop], [finished.parameters.measure], float("nan"), tags, FLOATS)


def write_count(finished: FinishedDopMap, path: Path) -> None:
    """Anchors surely in sight; the largest value (nodata) where the visible set is unknown."""
    small = len(finished.anchors) < 255
    dtype = np.uint8 if small else np.uint16
    nodata = int(np.iinfo(dtype).max)
    count = np.where(finished.reasons == DopReason.UNKNOWN, nodata, finished.count).astype(dtype)
    tags = {**_tags(finished), "units": "anchors"}
    write_cog(path, finished.grid, [count], ["visible anchors"], nodata, tags, BYTES)


def write_position_error(finished: FinishedDopMap, path: Path) -> None:
    """float32 metres, one sigma: horizontal, vertical, position; NaN unknown (nodata), +inf no fix."""
    tags = {**_tags(finished), "units": "metre", "infinity": "no fix"}
    names = ["horizontal sigma", "vertical sigma", "position sigma"]
    write_cog(path, finished.grid, finished.sigmas_m, names, float("nan"), tags, FLOATS)


def write_no_go(finished: FinishedDopMap, path: Path) -> None:
    """uint8: 1 no-go, 0 go, 255 unknown (nodata)."""
    tags = {**_tags(finished), "units": "class: 1 no-go, 0 go, 255 unknown"}
    write_cog(path, finished.grid, [finished.no_go], ["no-go"], int(UNKNOWN), tags, BYTES)


def _write_zones(finished: FinishedDopMap, path: Path) -> None:
    write_no_go_zones(finished.grid, finished.no_go, finished.parameters, path)


def _write_contours(finished: FinishedDopMap, path: Path) -> None:
    write_contours(finished.grid, finished.dop, finished.parameters, path)


def write_path(finished: FinishedDopMap, path: Path) -> None:
    """One line per point: PATH_COLUMNS, reason in words, and the ids in sight, with spaces between."""
    ids = [anchor.id for anchor in finished.anchors]
    bits = np.unpackbits(finished.path_sets.astype("<u8").view(np.uint8), axis=1, bitorder="little")[:, : len(ids)]
    reason, whole = (
        PATH_COLUMNS.index("reason"),
        (PATH_COLUMNS.index("anchors_in_sight"), PATH_COLUMNS.index("unknown")),
    )
    with path.open("w", encoding="utf-8", newline="") as file:
        table = TableWriter(file, end="\r\n")
        table.row([*PATH_COLUMNS, "ids_in_sight"])
        for numbers, seen in zip(finished.path_numbers.tolist(), bits, strict=True):
            cells: list[str] = [f"{number:.10g}" for number in numbers]
            cells[reason] = DopReason(int(numbers[reason])).name.lower()
            for column in whole:
                cells[column] = str(int(numbers[column]))
            table.row([*cells, " ".join(ids[number] for number in np.flatnonzero(seen))])


# matplotlib and dask take a second to load, and only a process that draws or writes volumes needs them


def _write_picture(finished: FinishedDopMap, path: Path) -> None:
    from .picture import write_dop_picture

    write_dop_picture(finished, path)


def _write_overlay(finished: FinishedDopMap, path: Path) -> None:
    from .picture import write_dop_overlay

    write_dop_overlay(finished, path)


def _write_legend(finished: FinishedDopMap, path: Path) -> None:
    from .picture import write_dop_legend

    write_dop_legend(finished, path)


def _write_cut(number: int, finished: FinishedDopMap, path: Path) -> None:
    from .cut_picture import write_cut_picture

    write_cut_picture(finished, number, path)


def _write_volume_dop(finished: FinishedDopMap, path: Path) -> None:
    from .volume_files import write_volume_dop

    write_volume_dop(finished, path)


def _write_volume_count(finished: FinishedDopMap, path: Path) -> None:
    from .volume_files import write_volume_count

    write_volume_count(finished, path)


def _write_volume_arrays(finished: FinishedDopMap, path: Path) -> None:
    from .volume_files import write_volume_arrays

    write_volume_arrays(finished, path)


def _write_volume_dataset(finished: FinishedDopMap, path: Path) -> None:
    from .volume_files import write_volume_dataset

    write_volume_dataset(finished, path)


def _tags(finished: FinishedDopMap) -> dict[str, str]:
    parameters = finished.parameters
    return {
        **common_tags(finished.grid, finished.answer, "sightline DOP map"),
        "receiver": f"{parameters.receiver_above_ground_m:g} m above ground",
        "kind": parameters.kind,
        "measure": parameters.measure + (" along the surface" if parameters.on_surface else ""),
        "dop_limit": f"{parameters.dop_limit:g}",
    }


LAYERS = (
    Layer(
        "dop.tif",
        COG,
        "float32: the dilution of precision asked for; +inf no fix, NaN (nodata) unknown.",
        write_dop,
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
        write_position_error,
    ),
    Layer(
        "no_go.tif",
        COG,
        "uint8: 1 where the dilution is the limit or more, or too few anchors are in sight; 0 elsewhere; 255 (nodata) "
        "unknown.",
        write_no_go,
    ),
    Layer(
        "no_go.geojson",
        GEOJSON,
        "Polygons round the posts of no_go.tif that are 1, with their area.",
        _write_zones,
    ),
    Layer(
        "contours.geojson",
        GEOJSON,
        "Lines along which the dilution is the limit, half of it and twice as much.",
        _write_contours,
    ),
    Layer(
        "map.png",
        PNG,
        "A picture of the dilution over shaded relief, with the line of the limit, anchors and legend.",
        _write_picture,
    ),
    Layer(
        "overlay.png",
        PNG,
        "The colours of map.png alone, from corner to corner of the DEM's cells; clear where no ground is known.",
        _write_overlay,
        for_screens=True,
    ),
    Layer(
        "legend.json",
        JSON,
        "What the colours mean: label, colour #rrggbb, known posts and their share 0..1 of each class.",
        _write_legend,
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
            partial(_write_cut, number - 1),
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
        _write_volume_dop,
        needs="volume",
    ),
    Layer(
        "volume_count.tif",
        GEOTIFF,
        "A band for each layer of the volume: how many anchors are surely in sight, nodata (largest value) where that "
        "of some is unknown.",
        _write_volume_count,
        needs="volume",
    ),
    Layer(
        "volume.npz",
        "application/x-npz",
        "Arrays over layers, rows and columns for numpy: dilution, count, and the visible set as bits, anchor a being "
        "bit a % 64 of word a // 64.",
        _write_volume_arrays,
        needs="volume",
    ),
    Layer(
        "volume.nc",
        "application/x-netcdf",
        "The same as NetCDF with coordinates and CRS, as xarray opens it.",
        _write_volume_dataset,
        needs="volume",
    ),
)
