"""The control volume and its cuts as options write them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from service.errors import RequestError

from .height_words import height_fields

__all__ = ["VOLUME_FILES", "VolumeOptions", "ceiling_fields", "cut_fields"]

VOLUME_FILES = ("volume_dop.tif", "volume_count.tif", "volume.npz", "volume.nc")
CUT_FORM = "a line EAST,NORTH,EAST,NORTH of two or more places nor a height like 1000msl or 50agl"


@dataclass(frozen=True, slots=True)
class VolumeOptions:
    """--volume and what goes with it, as typed."""

    wanted: bool
    ceiling: str | None
    floor: float | None
    layer: float | None
    bounds: str | None

    def fields(self) -> dict[str, Any] | None:
        """The ``volume`` of a request; None without any of these options. Raises RequestError."""
        others = (self.floor, self.layer, self.bounds)
        if self.ceiling is None:
            if self.wanted or any(value is not None for value in others):
                raise RequestError("--volume, --floor, --layer and --bounds need --ceiling, such as --ceiling 2500msl.")
            return None
        fields = {**ceiling_fields(self.ceiling), "floor_m": self.floor, "layer_m": self.layer}
        if self.bounds is not None:
            fields["bounds_m"] = _bounds(self.bounds)
        return {name: value for name, value in fields.items() if value is not None}

    @property
    def left_out(self) -> tuple[str, ...]:
        """Files that are not written: a volume may be there for its cuts only."""
        return () if self.wanted else VOLUME_FILES


def ceiling_fields(text: str) -> dict[str, Any]:
    """--ceiling as the fields of a request. Raises RequestError."""
    fields = height_fields(text, "ceiling_")
    if fields is None:
        raise RequestError(f"--ceiling {text!r} is not of the form 2500msl (altitude) or 300agl (above ground).")
    return fields


def cut_fields(text: str, *, lonlat: bool) -> dict[str, Any]:
    """One --cut as an entry of a request's ``cuts``. Raises RequestError."""
    height = height_fields(text)
    if height is not None:
        return height
    numbers = _numbers(text)
    if numbers is None or len(numbers) < 4 or len(numbers) % 2:
        raise RequestError(f"--cut {text!r} is neither {CUT_FORM}.")
    first, second = ("lon_deg", "lat_deg") if lonlat else ("east_m", "north_m")
    return {"line": [{first: a, second: b} for a, b in zip(numbers[::2], numbers[1::2], strict=True)]}


def _bounds(text: str) -> dict[str, float]:
    numbers = _numbers(text)
    if numbers is None or len(numbers) != 4:
        raise RequestError(f"--bounds {text!r} is not of the form WEST,SOUTH,EAST,NORTH in metres.")
    return dict(zip(("west_m", "south_m", "east_m", "north_m"), numbers, strict=True))


def _numbers(text: str) -> list[float] | None:
    try:
        return [float(part) for part in text.split(",")]
    except ValueError:
        return None
