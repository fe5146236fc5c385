"""``sightline protect``: how far off a position may be though nothing is noticed, over a DEM and along a path."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from rich.table import Table

from ..asking.ground import AreaOptions, Margin
from ..asking.options import (
    GROUP,
    AnchorOptions,
    Curvature,
    DemPath,
    Output,
    RangeSigma,
    Reading,
    ReceiverHeight,
    RequestFile,
    option,
    told,
)
from ..output import facts_table, share_text

if TYPE_CHECKING:
    from pydantic import BaseModel

    from service.products.protection_levels.calculate import ProtectionSummary

__all__ = ["protect"]


@GROUP
@dataclass(frozen=True, slots=True)
class ProtectionOptions:
    """What may be missed, and how the ground is used: fields of the request."""

    kind: Annotated[Literal["ranging", "pseudorange"], option("Ranges; ranges with an unknown clock.")] = "ranging"
    receiver_above_ground_m: ReceiverHeight = None
    spacing_m: Annotated[
        float | None, option("Between the posts of the map. (default every post)", "M", "--spacing")
    ] = None
    height_sigma_m: Annotated[
        float | None,
        option("One sigma of the height that the DEM tells. (default it is not used)", "M", "--height-sigma"),
    ] = None
    dem_sigma_m: Annotated[
        float | None, option("One-sigma error of the ground in the way. (default 3)", "M", "--dem-sigma")
    ] = None
    missed: Annotated[float | None, option("What may be missed. (default 1e-4)", "PROBABILITY")] = None
    false_alarm: Annotated[float | None, option("Rate of false alarms. (default 1e-3)", "PROBABILITY")] = None
    unwatched: Annotated[
        float | None,
        option("Sets of wrong ranges less likely than that are not looked at. (default 1e-6)", "PROBABILITY"),
    ] = None
    most_faults: Annotated[int | None, option("Wrong ranges at once, at most. (default 3)", "N")] = None
    fault: Annotated[
        float | None, option("That the range of an anchor in sight is wrong. (default 1e-3)", "PROBABILITY")
    ] = None
    least_sight: Annotated[
        float | None, option("Ranges of less probability of sight are left out. (default 0.5)", "PROBABILITY")
    ] = None
    horizontal_alert_m: Annotated[
        float | None, option("Alert limit of the horizontal level. (default 10)", "M", "--horizontal-alert")
    ] = None
    vertical_alert_m: Annotated[
        float | None, option("Alert limit of the vertical level. (default 10)", "M", "--vertical-alert")
    ] = None
    curvature: Annotated[Curvature, option("auto: as the DEM's CRS implies; flat: none.")] = "auto"


def protect(
    dem: DemPath,
    /,
    *,
    anchors: AnchorOptions = AnchorOptions(),
    range_sigma: RangeSigma = None,
    options: ProtectionOptions = ProtectionOptions(),
    path: Annotated[
        Path | None,
        option(
            "CSV of east_m, north_m, above_ground_m (or altitude_m), or path.csv of a plan or a GeoJSON LineString, "
            "which are --receiver-height above the ground: adds path.csv.",
            "FILE",
        ),
    ] = None,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Foretell how far off a position may be though nothing is noticed, over a DEM and along a route.

    Writes protection.json, protection.tif, unwatched.tif, map.png and
    vertical.png into --out, with a --path also path.csv, path.geojson and
    profile.png.
    """
    from service.products.protection_levels import PROTECTION_LEVELS
    from service.products.protection_levels.request import ProtectionParameters

    from ..asking.path_files import path_from_file
    from ..asking.products import ask, request_of_fields

    asked: BaseModel | Path | None = request
    if asked is None:
        asked_m = options.receiver_above_ground_m
        fields = ProtectionParameters.model_fields
        antenna_m = fields["receiver_above_ground_m"].default if asked_m is None else asked_m
        asked = request_of_fields(
            {
                **told(options),
                "anchors": anchors.part(range_sigma),
                "path": [] if path is None else path_from_file(path, antenna_m),
                "area": area.part(in_degrees=anchors.lonlat),
            },
            ProtectionParameters,
        )
    ask(
        PROTECTION_LEVELS,
        dem,
        asked,
        _tables,
        summary="protection.json",
        what="Protection levels",
        reading=reading,
        output=output,
        margin_m=margin_m,
    )


def _tables(answer: ProtectionSummary) -> tuple[Table, ...]:
    facts = [
        ("one sigma of a range", answer.sigmas),
        ("anything promised", share_text(answer.promised_share)),
        ("within the alert limits", share_text(answer.within_alert_share)),
        *((f"horizontal {name}", _metres(metres)) for name, metres in answer.horizontal_quantiles_m.items()),
        *((f"vertical {name}", _metres(metres)) for name, metres in answer.vertical_quantiles_m.items()),
    ]
    if answer.path is not None:
        along = answer.path
        beyond = "none" if along.first_beyond is None else f"point {along.first_beyond}"
        facts += [
            ("points of the path within them", f"{along.within_alert:,} of {along.points:,}"),
            ("the first that is not", beyond),
        ]
    return (facts_table(f"{answer.dem.name}: protection levels", facts),)


def _metres(metres: float | None) -> str:
    return "–" if metres is None else f"{metres:.1f} m"
