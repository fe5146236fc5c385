"""What a satellite receiver heard, as requests have it: texts of RINEX files, on the clock of the readings."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Annotated

import numpy as np
import numpy.typing as npt
from pydantic import ConfigDict, Field

from gnss import GpsTime
from gnss.differential.orbits import check_orbit_text
from gnss.differential.rinex_lines import check_lines
from navigation import MeasurementError
from navigation.drives import Satellites
from service.parts.points import Number, StrictModel

if TYPE_CHECKING:
    from gnss.differential import ReceiverRanges

__all__ = ["ReceiverIn", "satellites_of"]

Array = npt.NDArray[np.float64]
MOST_CHARACTERS, MOST_FILES = 50_000_000, 8
OBSERVATIONS = "the observation file"
WEEK_S = 604_800.0
UNIX_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)

Text = Annotated[str, Field(min_length=1, max_length=MOST_CHARACTERS)]


class ReceiverIn(StrictModel):
    """A satellite receiver's observations, and the orbits of what it heard."""

    model_config = ConfigDict(json_schema_extra={"examples": [{"observations": "…", "orbits": ["…"]}]})

    observations: Text = Field(description="Text of a RINEX 2 or 3 observation file.")
    orbits: Annotated[list[Text], Field(min_length=1, max_length=MOST_FILES)] = Field(
        description="Texts of RINEX 2 or 3 navigation files, and of SP3 files where there are."
    )
    zero_gps_s: Number | None = Field(
        None,
        description="GPS time since 1980-01-06 of the readings' time 0, seconds; left out = their times are GPS time, "
        "its seconds of the week, or UTC since 1970, whichever fits the observations.",
    )


def satellites_of(asked: ReceiverIn, readings_s: Array) -> tuple[Satellites, tuple[str, ...]]:
    """(what was heard, ECEF, on the readings' clock; in sentences what to know of it).

    Raises AlmanacFileError, GnssInputError, GnssLibraryError, MeasurementError.
    """
    heard = ranges_of(asked)
    zero_s, sentence = _zero(asked.zero_gps_s, heard.time_s, readings_s)
    names, number = np.unique(heard.satellite, return_inverse=True)
    told = f"A receiver heard {len(names)} satellites at {len(np.unique(heard.time_s)):,} epochs. {sentence}"
    return Satellites(
        heard.time_s - zero_s,
        number.astype(np.int64),
        heard.position_ecef_m,
        heard.code_m,
        heard.phase_m,
        heard.arc,
        heard.place_ecef_m,
    ), (told, *heard.warnings)


def check_files(asked: ReceiverIn) -> None:
    """Whether the files are what they are said to be, and whole. Raises AlmanacFileError."""
    check_lines(asked.observations.splitlines(), OBSERVATIONS)
    for text, name in _orbit_files(asked):
        check_orbit_text(text, name)


def _orbit_files(asked: ReceiverIn) -> list[tuple[str, str]]:
    many = len(asked.orbits) > 1
    return [(text, f"orbits[{n}]" if many else "the orbit file") for n, text in enumerate(asked.orbits)]


def ranges_of(asked: ReceiverIn) -> ReceiverRanges:
    """The files' codes and phases, put right. Raises AlmanacFileError, GnssInputError, GnssLibraryError."""
    from gnss.differential import parse_observations, parse_orbits, receiver_ranges

    observed = parse_observations(asked.observations, OBSERVATIONS)
    return receiver_ranges(observed, parse_orbits(_orbit_files(asked)))


def _zero(given_s: float | None, heard_s: Array, readings_s: Array) -> tuple[float, str]:
    """(GPS time of the readings' zero, which of the clocks that are usual it is). Raises MeasurementError."""
    first, last = float(readings_s.min()), float(readings_s.max())

    def overlap_s(zero_s: float) -> float:
        return min(last + zero_s, float(heard_s[-1])) - max(first + zero_s, float(heard_s[0]))

    if given_s is not None:
        if overlap_s(given_s) < 0.0:
            raise MeasurementError(
                f"With zero_gps_s {given_s:.3f} the readings lie {-overlap_s(given_s):.0f} s from the observations."
            )
        return given_s, "zero_gps_s tells the readings' clock."
    at = UNIX_EPOCH + timedelta(seconds=first) if 0.0 <= first < 1e10 else UNIX_EPOCH
    in_utc = GpsTime.of_utc(max(at, datetime(1980, 1, 6, tzinfo=UTC)))
    week_s = WEEK_S * np.floor(heard_s[0] / WEEK_S)
    clocks = [
        (0.0, "The readings' times are GPS time."),
        (float(week_s), "The readings' times are seconds of the GPS week."),
        (float(week_s - WEEK_S), "The readings' times are seconds of the GPS week that ended while they went on."),
        (in_utc.week * WEEK_S + in_utc.second_of_week - first, "The readings' times are UTC."),
    ]
    for zero_s, sentence in clocks:
        if overlap_s(zero_s) >= 0.0:
            return zero_s, sentence
    raise MeasurementError(
        f"The readings' times, {first:.1f} to {last:.1f} s, meet the observations' (GPS time {heard_s[0]:.1f} to "
        f"{heard_s[-1]:.1f} s, seconds {heard_s[0] % WEEK_S:.1f} to {heard_s[-1] % WEEK_S:.1f} of its week) neither as "
        "GPS time, nor as seconds of its week or UTC since 1970; give zero_gps_s."
    )
