"""``sightline morph``: above which altitude positioning is good enough."""

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

    from service.products.morphing.calculate import MorphingMapSummary

__all__ = ["morph"]

MESHES = ("surface.glb", "surface.stl")
CEILING = "Top of the air: 2500msl (altitude) or 300agl (above ground)."


@GROUP
@dataclass(frozen=True, slots=True)
class MotionOptions:
    """Anchors that move, and times: the ``tracks`` and ``frames`` of a request."""

    track: Annotated[
        tuple[Path, ...],
        option(
            "Anchors that move: CSV of id, time_s, east_m, north_m, above_ground_m (or altitude_m), or .json. "
            "Repeatable.",
            "FILE",
        ),
    ] = ()
    frames: Annotated[
        str | None, option("Frames over time, seconds; 0 is --time. Adds files and animation.", "FROM,TO,STEP")
    ] = None
    available_at: Annotated[
        str | None, option("Availability at 60agl or 1500msl. (default --receiver-height)", "HEIGHT")
    ] = None


def morph(
    dem: DemPath,
    /,
    *,
    ceiling: Annotated[str | None, option(f"{CEILING} Required.", "HEIGHT")] = None,
    anchors: AnchorOptions = AnchorOptions(),
    satellites: SatelliteOptions = SatelliteOptions(),
    positioning: PositioningOptions = PositioningOptions(),
    mesh: Annotated[bool, option("Write surface.glb and surface.stl, where the dilution is the limit.")] = False,
    mesh_layer: Annotated[
        float | None, option("Thickness of their voxels, metres. (default the smaller cell)", "M")
    ] = None,
    motion: MotionOptions = MotionOptions(),
    sight: SignalOptions = SignalOptions(),
    doubts: DoubtOptions = TRUSTING,
    area: AreaOptions = AreaOptions(),
    margin_m: Margin = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Calculate the Digital Morphing Map: above which altitude positioning is good enough.

    Writes morph.json, altitude.tif, above_ground.tif, flags.tif, no_go.geojson,
    contours.geojson and map.png into --out; with --mesh surface.glb and
    surface.stl; with --frames frames_altitude.tif, frames_state.tif,
    availability.tif, availability.png and animation.gif.
    """
    from service.parts.positioning import MorphingMapParameters

    from .asking.anchor_files import tracks_from_file
    from .asking.products import ask, request_of_fields
    from .asking.texts import ceiling_fields, frames_fields

    asked: BaseModel | Path | None = request
    if asked is None:
        if ceiling is None:
            raise RequestError(f"Missing option '--ceiling': {CEILING}")
        fields: dict[str, object] = {
            **told(positioning),
            **ceiling_fields(ceiling),
            **({} if mesh_layer is None else {"surface_layer_m": mesh_layer}),
            "tracks": [one for file in motion.track for one in tracks_from_file(file)],
            "frames": frames_fields(motion.frames, motion.available_at),
            **sight.part(anchors.part()),
            **doubts.part(),
            "area": area.part(in_degrees=anchors.lonlat),
            "satellites": satellites.part(),
        }
        if not fields["anchors"] and not fields["tracks"] and fields["satellites"] is None:
            raise nothing_to_range_to()
        asked = request_of_fields(fields, MorphingMapParameters)
    from service.products.morphing import MORPHING_MAP

    ask(
        MORPHING_MAP,
        dem,
        asked,
        _tables,
        summary="morph.json",
        left_out=() if mesh else MESHES,
        reading=reading,
        output=output,
        margin_m=margin_m,
    )


def _tables(answer: MorphingMapSummary) -> tuple[Table, ...]:
    ceiling = answer.ceiling
    top = (
        f"{ceiling['above_ground_m']:g} m above ground"
        if ceiling["above_ground_m"] is not None
        else f"altitude {ceiling['altitude_m']:g} m"
    )
    facts = [
        *((state.words, share_text(state.share)) for state in answer.states),
        ("posts with several no-flight intervals", f"{answer.posts_with_several_intervals:,}"),
        *(
            (f"flyable above ground {name}", "–" if m is None else f"{m:.0f} m")
            for name, m in answer.above_ground_m.items()
        ),
    ]
    over_time = answer.over_time
    if over_time is not None:
        ((height, metres),) = over_time.available_at.items()
        facts += [
            ("frames", f"{len(over_time.frames)}"),
            (f"available at {metres:g} m {'agl' if height == 'above_ground_m' else 'msl'}", ""),
            ("  always", share_text(over_time.share_always_available)),
            ("  sometimes", share_text(over_time.share_sometimes_available)),
            ("  never", share_text(over_time.share_never_available)),
        ]
    good = f"{answer.measure.upper()} of {answer.kind} < {answer.dop_limit:g}"
    title = f"{answer.dem.name}: from where up one may fly, with {good} up to {top}"
    return sources_table(answer.curvature, answer.anchors, answer.satellites), facts_table(title, facts)
