"""How a log is written: which of its columns or messages hold what, and in which units; also as a file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, Self

from pydantic import Field, ValidationError, model_validator

from service.errors import RequestError
from service.files.csv_table import text_of
from service.parts.points import StrictModel
from service.parts.sentences import sentence_of

__all__ = [
    "COLUMNS",
    "LENGTHS_M",
    "MOTION_FIELDS",
    "ODOMETRY",
    "PLAIN",
    "RANGE",
    "TIMES_S",
    "TIME_PARTS",
    "WIDE",
    "LogForm",
    "LogMap",
    "StreamMap",
    "map_of",
    "read_map",
]

RANGE = ("anchor_id", "range_m", "sigma_m", "p_sight")
ODOMETRY = ("duration_s", "wheel_x_m", "wheel_y_m", "accel_x_m", "accel_y_m", "accel_z_m", "heading_deg")
COLUMNS = ("time_s", *RANGE, *ODOMETRY)
# parts of a time that other programs give columns of their own
TIME_PARTS = ("date", "nanoseconds")
# with all ranges of a moment in one row: range_m.D1, sigma_m.D1, p_sight.D1
WIDE = ("range_m.", "sigma_m.", "p_sight.")
LENGTHS_M = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "km": 1e3, "ft": 0.3048}
TIMES_S = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
MOTION_FIELDS = (
    ("x_m", "y_m", "z_m"),  # a position in a frame of its own
    ("east_m", "north_m", "up_m"),  # a position along the anchors' axes
    ("forward_m", "left_m", "up_m"),  # a displacement since the message before
    ("travelled_m",),  # a way that adds up, or those of several wheels
    ("speed_forward_m_per_s", "speed_left_m_per_s"),
)
TimeUnit = Literal["s", "ms", "us", "ns"]
RangeUnit = Literal["m", "mm", "cm", "km", "ft"]
DateOrder = Literal["dmy", "mdy"]


class StreamMap(StrictModel):
    """What the messages of one name (a topic, a message type) are taken for.

    In a path dots lead into fields, [3] into a list, [] to all of one; "=D1" is the text D1, "@stream" the last part of
    the stream's name. MOTION_FIELDS lists what a motion is made of.
    """

    stream: str = Field(description="Topic or name of message.")
    role: Literal["ranges", "motion", "heading"] = Field(description="What its messages hold.")
    fields: dict[str, str] = Field(
        description="Path in the message of time_s, anchor_id, range_m (range_m.ID for ranges without ids), sigma_m; "
        "x_m …, heading_deg, orientation (a quaternion in east, north, up)."
    )
    units: dict[str, str] = Field({}, description="Of fields that are not in seconds, metres and degrees.")
    missing: float | None = Field(None, description="The number that stands for a range that failed.")

    @model_validator(mode="after")
    def _fields_are_known(self) -> Self:
        known = {"time_s", "heading_deg", "orientation", *(name for names in MOTION_FIELDS for name in names)}
        known |= {"duration_s", "down_m"} if self.role == "motion" else set(RANGE)
        for name in self.fields:
            if name not in known and not (self.role == "ranges" and name.startswith(WIDE)):
                raise ValueError(f"{name!r} is no field of {self.role}.")
        for name, unit in self.units.items():
            if name not in self.fields:
                raise ValueError(f"a unit is given for {name!r}, which is no field here.")
            if unit not in {**TIMES_S, **LENGTHS_M, "rad": 1.0, "deg": 1.0}:
                raise ValueError(f"{unit!r} is no unit: take {', '.join((*TIMES_S, *LENGTHS_M, 'rad', 'deg'))}.")
        return self


class LogMap(StrictModel):
    """A mapping as ``sightline log`` writes and ``--map`` reads it; what is left out is found in the log."""

    columns: dict[str, str] = Field({}, description="Of a table: our name of a column to the name in the file.")
    time_unit: TimeUnit | None = Field(None, description="Of time_s in a table.")
    range_unit: RangeUnit | None = Field(None, description="Of range_m and sigma_m in a table.")
    date_order: DateOrder | None = Field(None, description="Of dates like 03/04/2024.")
    anchor_id: str | None = Field(None, description="Of all ranges of a table that names no anchor.")
    ids: dict[str, str] = Field({}, description="Ids in the log to ids of anchors.")
    streams: list[StreamMap] = Field([], description="Of logs of messages; an empty list: those that are known.")


@dataclass(frozen=True, slots=True)
class LogForm:
    """What of a log is otherwise than documented; None: as the log itself tells.

    columns: our name of a column to that in the file. time_unit, range_unit: of time_s, and of range_m and sigma_m, out
    of TIMES_S and LENGTHS_M. anchor_id: of ranges that name no anchor. ids: of the log to those of anchors.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    time_unit: str | None = None
    range_unit: str | None = None
    date_order: str | None = None
    anchor_id: str | None = None
    ids: Mapping[str, str] = field(default_factory=dict)
    streams: tuple[StreamMap, ...] = ()

    def __post_init__(self) -> None:
        for what, unit, units in (("time", self.time_unit, TIMES_S), ("range", self.range_unit, LENGTHS_M)):
            if unit is not None and unit not in units:
                raise RequestError(f"A {what} unit is one of {', '.join(units)}, not {unit!r}.")
        if self.date_order not in (None, "dmy", "mdy"):
            raise RequestError(f"An order of dates is dmy or mdy, not {self.date_order!r}.")
        for name, column in self.columns.items():
            if name not in (*COLUMNS, *TIME_PARTS) and not (name.startswith(WIDE) and name.partition(".")[2]):
                raise RequestError(f"{name!r} is no column of a log: take {', '.join(COLUMNS)}, or range_m.ID.")
            if not column:
                raise RequestError(f"Column {name} needs the name of a column in the file.")


PLAIN = LogForm()


def read_map(path: Path) -> LogForm:
    """The mapping in a file. Raises RequestError."""
    text = text_of(path, "mapping")
    try:
        told = LogMap.model_validate_json(text)
    except ValidationError as error:
        raise RequestError(f"The mapping {path.name}: {sentence_of(error)}") from error
    return LogForm(
        told.columns,
        told.time_unit,
        told.range_unit,
        told.date_order,
        told.anchor_id,
        told.ids,
        tuple(told.streams),
    )


def map_of(form: LogForm) -> str:
    """The same as text, JSON without what it does not say."""
    told = LogMap.model_validate(
        {
            "columns": dict(form.columns),
            "time_unit": form.time_unit,
            "range_unit": form.range_unit,
            "date_order": form.date_order,
            "anchor_id": form.anchor_id,
            "ids": dict(form.ids),
            "streams": list(form.streams),
        }
    )
    return json.dumps(told.model_dump(exclude_defaults=True), indent=2, ensure_ascii=False)
