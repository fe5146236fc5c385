"""``sightline dop``: how good positioning is for a rover, over a whole DEM."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from rich.table import Table

from service.errors import RequestError

from .asking.doubts import TRUSTING, DoubtOptions
from .asking.ground import AreaOptions, Margin
from .asking.options import (
    GROUP,
    AnchorOptions,
    DemPath,
    Output,
    PositioningOptions,
    RangeSigma,
    Reading,
    RequestFile,
    SignalOptions,
    option,
    told,
)
from .asking.satellites import SatelliteOptions, nothing_to_range_to, sources_table
from .output import facts_table, share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.products.dop.calculate import DopMapSummary

__all__ = ["dop"]

VOLUME_FILES = ("volume_dop.tif", "volume_count.tif", "volume.npz", "volume.nc")


@GROUP
@dataclass(frozen=True, slots=True)
class RoverOptions:
    """How the rover is bound: fields of the request."""

    on_surface: Annotated[
        bool, option("The rover is on the ground: only its motion along it is unknown.", name="--surface")
    ] = False
    one_dop_per_set: Annotated[bool, option("One dilution for each visible set; right for satellites only.")] = False


@GROUP
@dataclass(frozen=True, slots=True)
class VolumeOptions:
    """The ``volume`` of a request."""

    volume: Annotated[bool, option("Write every voxel: volume.npz, volume.nc and GeoTIFFs; with --ceiling.")] = False
    ceiling: Annotated[str | None, option("Top of the volume and of vertical cuts: 2500msl, or 300agl.", "HEIGHT")] = (
        None
    )
    floor_m: Annotated[
        float | None, option("Its lowest layer, counted as the ceiling is. (default the lowest ground)", "M", "--floor")
    ] = None
    layer_m: Annotated[
        float | None, option("From layer to layer. (default the cell, at most 100 layers)", "M", "--layer")
    ] = None
    bounds: Annotated[str | None, option("Its sides, metres. (default the whole DEM)", "WEST,SOUTH,EAST,NORTH")] = None

    def part(self) -> dict[str, object] | None:
        """As the request has it; None without any of these options. Raises RequestError."""
        from .asking.texts import bounds_fields, ceiling_fields

        sizes = {"floor_m": self.floor_m, "layer_m": self.layer_m}
        if self.ceiling is None:
            if self.volume or self.bounds is not None or any(size_m is not None for size_m in sizes.values()):
                raise RequestError("--volume, --floor, --layer and --bounds need --ceiling, such as --ceiling 2500msl.")
            return None
        found: dict[str, object] = {name: size_m for name, size_m in sizes.items() if size_m is not None}
        if self.bounds is not None:
            found["bounds_m"] = bounds_fields(self.bounds)
        return {**ceiling_fields(self.ceiling), **found}


def dop(
    dem: DemPath,
    /,
    *,
    anchors: AnchorOptions = AnchorOptions(),
    satellites: SatelliteOptions = SatelliteOptions(),
    positioning: PositioningOptions = PositioningOptions(),
    range_sigma: RangeSigma = None,
    rover: RoverOptions = RoverOptions(),
    path: Annotated[
        Path | None,
        option(
            "CSV of east_m, north_m, above_ground_m (or altitude_m), or path.csv of a plan or a GeoJSON LineString, "
            "which are --receiver-height above the ground: adds path.csv.",
            "FILE",
        ),
    ] = None,
    cut: Annotated[
        tuple[str, ...],
        option(
            "A picture of a cut: vertical along EAST,NORTH,EAST,NORTH, or horizontal at 1000msl or 50agl. Repeatable.",
            "LINE|HEIGHT",
        ),
    ] = (),
    volume: VolumeOptions = VolumeOptions(),
    sight: SignalOptions = SignalOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Calculate how good positioning is for a rover, over a whole DEM.

    Writes dop.json, dop.tif, count.tif, position_error.tif, no_go.tif,
    no_go.geojson, contours.geojson and map.png into --out, path.csv where a
    --path is given, cut-1.png and so on for each --cut, and with --volume the
    voxels.
    """
    from service.products.dop.request import DopMapParameters

    from .asking.path_files import path_from_file
    from .asking.products import ask, request_of_fields
    from .asking.texts import cut_fields

    asked: BaseModel | Path | None = request
    left_out = () if volume.volume or request is not None else VOLUME_FILES
    if asked is None:
        air, asked_m = volume.part(), positioning.receiver_above_ground_m
        antenna_m = DopMapParameters.model_fields["receiver_above_ground_m"].default if asked_m is None else asked_m
        fields: dict[str, object] = {
            **told(positioning),
            **told(rover),
            "path": [] if path is None else path_from_file(path, antenna_m),
            "volume": air,
            "cuts": [cut_fields(text, lonlat=anchors.lonlat) for text in cut],
            **sight.part(anchors.part(range_sigma)),
            **doubts.part(),
            "area": area.part(in_degrees=anchors.lonlat),
            "satellites": satellites.part(range_sigma),
        }
        if not fields["anchors"] and fields["satellites"] is None:
            raise nothing_to_range_to()
        asked = request_of_fields(fields, DopMapParameters)
    from service.products.dop import DOP_MAP

    ask(
        DOP_MAP,
        dem,
        asked,
        _tables,
        summary="dop.json",
        left_out=left_out,
        reading=reading,
        output=output,
        margin_m=margin_m,
    )


def _tables(answer: DopMapSummary) -> tuple[Table, ...]:
    measure = answer.measure.upper()
    facts = [
        (f"{measure} < {answer.dop_limit:g}", share_text(answer.share_within_limit)),
        ("no-go", share_text(answer.share_no_go)),
        ("unknown", share_text(answer.share_unknown)),
        *(
            (f"{measure} {name}", "no fix" if dop is None else f"{dop:.2f}")
            for name, dop in answer.dop_quantiles.items()
        ),
        *(
            (f"{name} error p50", "no fix" if quantiles_m["p50"] is None else f"{quantiles_m['p50']:.3g} m")
            for name, quantiles_m in answer.position_error_quantiles_m.items()
        ),
        *([("  one sigma of a range", answer.sigmas)] if answer.sigmas else []),
        *([] if answer.volume is None else [("voxels of the volume", f"{answer.volume.voxels:,}")]),
        *((f"posts {name.replace('_', ' ')}", f"{posts:,}") for name, posts in answer.posts_by_reason.items()),
    ]
    bound = ", along the surface" if answer.on_surface else ""
    title = f"{answer.dem.name}: {answer.kind}, antenna {answer.receiver_above_ground_m:g} m above ground{bound}"
    return sources_table(answer.curvature, answer.anchors, answer.satellites), facts_table(title, facts)
