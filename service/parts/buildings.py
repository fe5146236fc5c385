"""Building meshes, as requests bring them along: a file's bytes, and how it lies on the DEM."""

from __future__ import annotations

from typing import Literal

from pydantic import Base64Bytes, Field

from service.parts.points import Metres, StrictModel

__all__ = ["BuildingsIn"]


class BuildingsIn(StrictModel):
    """Buildings that stand on the DEM, in one .stl, .obj, .ply or .glb file, in metres."""

    name: str = Field(
        min_length=5,
        max_length=200,
        pattern=r"^[^/\\]*\.([sS][tT][lL]|[oO][bB][jJ]|[pP][lL][yY]|[gG][lL][bB])$",
        description="What the file is called; its ending tells the format: .stl, .obj, .ply or .glb.",
    )
    base64: Base64Bytes = Field(min_length=1, description="The file's bytes in base64.")
    heights: Literal["above_ground", "absolute"] = Field(
        "above_ground",
        description="Each separate body stands on the ground under the middle of its footprint, or the file's heights "
        "are altitudes.",
    )
    up: Literal["y", "z"] | None = Field(
        None, description="The file's upward axis; left out: y for .glb, as that format says, z for the others."
    )
    origin_east_m: Metres = Field(0.0, description="East of the file's own origin in the DEM's metric CRS, metres.")
    origin_north_m: Metres = Field(0.0, description="North of it, metres.")
