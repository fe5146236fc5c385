"""DOP maps as the service tells about them."""

from __future__ import annotations

from pydantic import BaseModel, Field

from service.parts.positioning_answers import PositioningSummary

__all__ = ["DopMapSummary", "VolumeFacts"]


class VolumeFacts(BaseModel):
    """How large a control volume is."""

    layers: int = Field(description="Number of layers.")
    rows: int = Field(description="Number of rows of posts.")
    cols: int = Field(description="Number of columns of posts.")
    voxels: int = Field(description="Number of voxels: layers times rows times columns.")
    lowest_layer_m: float = Field(description="Altitude of the lowest layer, or its height above ground, metres.")
    highest_layer_m: float = Field(description="The same of the highest layer, metres.")
    layers_above_ground: bool = Field(description="Whether layers count from the ground of each post.")


class DopMapSummary(PositioningSummary):
    """What a DOP map says in numbers, and how far to trust it."""

    receiver_above_ground_m: float = Field(description="Height of the antenna above ground, metres.")
    on_surface: bool = Field(description="Whether only motion along the surface is unknown.")
    share_within_limit: float | None = Field(description="Part of the known posts within the limit, 0..1.")
    share_no_go: float | None = Field(description="Part of the known posts beyond it or with too few anchors, 0..1.")
    share_unknown: float | None = Field(description="Part of the known posts where that is unknown, 0..1.")
    dop_quantiles: dict[str, float | None] = Field(
        description="p05, p50 and p95 of the dilution over the posts where it is known, no unit; null is no fix."
    )
    one_dop_per_set: bool = Field(False, description="Whether all posts of a visible set share one dilution.")
    position_error_quantiles_m: dict[str, dict[str, float | None]] = Field(
        {}, description="p05, p50 and p95 of the horizontal, vertical and position error, one sigma, metres."
    )
    path_points: int = Field(0, description="Number of points along the path.")
    volume: VolumeFacts | None = Field(None, description="The control volume, where one was asked for.")
    posts_by_reason: dict[str, int] = Field(
        description="Known posts with a fix (ok), too_few anchors, a singular geometry, or unknown sight."
    )
