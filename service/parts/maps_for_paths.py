"""What a finished map gives a path that is to be planned on it: its anchors, its limits, or the map itself."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from service.errors import RequestError

__all__ = ["MAP_KINDS", "kind_of_summary", "with_map"]

SIGHT = ("anchors", "satellites", "unknown", "curvature")
MAP_KINDS = ("visibility-map", "dop-map", "morphing-map")
# fields of summaries by which their kinds are told apart
TELLING = {"states": "morphing-map", "dop_quantiles": "dop-map", "count_histogram": "visibility-map"}


def with_map(fields: Mapping[str, Any], kind: str, asked: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a path's request with what the parameters of a finished map add; what the request says wins.

    A visibility map gives anchors and how sight lines are taken; a DOP map satellites and its limits as well; a
    morphing map takes the place of anchors. Raises RequestError.
    """
    if kind not in MAP_KINDS:
        raise RequestError(f"A path is planned on a visibility map, a DOP map or a morphing map, not on a {kind}.")
    if any(fields.get(name) for name in ("anchors", "tracks", "satellites", "morphing_map")):
        raise RequestError("A map brings its own anchors along; give the map, or anchors and satellites.")
    if kind == "morphing-map":
        return {**fields, "morphing_map": {name: value for name, value in asked.items() if name != "area"}}
    found = {name: asked[name] for name in SIGHT if asked.get(name)}
    found = {**found, **{name: value for name, value in fields.items() if name != "anchors" or value}}
    if kind == "dop-map":
        limits = {"dop_limit": asked["dop_limit"], "min_anchors": asked.get("min_anchors") or 0}
        limits |= {name: asked[name] for name in ("kind", "measure", "on_surface") if name in asked}
        found["limits"] = {**limits, **(fields.get("limits") or {})}
    height_m = asked.get("receiver_above_ground_m")
    if height_m is not None:
        found["rover"] = {"receiver_above_ground_m": height_m, **(fields.get("rover") or {})}
    return found


def kind_of_summary(summary: Mapping[str, Any]) -> str:
    """The kind of the map that a summary (visibility.json, dop.json, morph.json) is of. Raises RequestError."""
    for field, kind in TELLING.items():
        if field in summary and isinstance(summary.get("parameters"), Mapping):
            return kind
    raise RequestError("it is no visibility.json, dop.json or morph.json that Sightline wrote.")
