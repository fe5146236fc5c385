"""What lines of sight are asked for: pairs of points, and how lines are calculated."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import ConfigDict, Field, JsonValue, model_validator

from service.parts.anchors import CurvatureChoice
from service.parts.map_area import AreaParameters
from service.parts.map_facts import DEM_ID, DemId
from service.parts.points import Metres, PointIn, Positive, StrictModel
from service.parts.radios import SightChoice

__all__ = ["FROM", "PAIRS", "TO", "LineOptions", "LinesOfSightIn", "LinesOfSightParameters", "PairIn"]

SPEED_OF_LIGHT_M_PER_S = 299_792_458.0
FROM: dict[str, JsonValue] = {"east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0}
TO: dict[str, JsonValue] = {"east_m": 398100.0, "north_m": 3791700.0, "above_ground_m": 1.5}
PAIRS: dict[str, JsonValue] = {"dem_id": DEM_ID, "pairs": [{"from": FROM, "to": TO}], "frequency_hz": 2.4e9}
ARRAYS: dict[str, JsonValue] = {
    "dem_id": DEM_ID,
    "from_points_m": [[402300.0, 3795200.0, 1450.0]],
    "to_points_m": [[398100.0, 3791700.0, 612.5]],
}

Point3 = tuple[Metres, Metres, Metres]


class PairIn(StrictModel):
    """Two points; the line between them is straight."""

    model_config = ConfigDict(serialize_by_alias=True, json_schema_extra={"examples": [{"from": FROM, "to": TO}]})

    from_: PointIn = Field(alias="from", description="One end.")
    to: PointIn = Field(description="The other end.")


class LineOptions(StrictModel):
    """How lines are calculated."""

    wavelength_m: Positive | None = Field(
        None, description="Asks for the Fresnel clearance at this wavelength, metres; or give frequency_hz."
    )
    frequency_hz: Positive | None = Field(
        None, description="Asks for the Fresnel clearance at this frequency, hertz; or give wavelength_m."
    )
    dem_sigma_m: Positive | None = Field(
        None, description="Asks for the probability of sight under this one-sigma height error of the DEM, metres."
    )
    excess_path: bool = Field(True, description="Whether to calculate excess_path_m.")
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    @model_validator(mode="after")
    def _one_wavelength(self) -> Self:
        if self.wavelength_m is not None and self.frequency_hz is not None:
            raise ValueError("Give wavelength_m or frequency_hz, not both.")
        return self

    @property
    def asked_wavelength_m(self) -> float | None:
        """The wavelength, whichever way it was given."""
        return self.wavelength_m if self.frequency_hz is None else SPEED_OF_LIGHT_M_PER_S / self.frequency_hz


class LinesOfSightParameters(LineOptions, AreaParameters, SightChoice):
    """Pairs of points on a DEM, as objects or, shorter, as two arrays of east, north and altitude in metres.

    Of an area every line has an end in it.
    """

    sight_alone = "lines have no anchors with radios; a profile tells a signal."

    pairs: list[PairIn] | None = Field(None, description="The pairs as objects; or give both arrays.")
    from_points_m: list[Point3] | None = Field(
        None, description="One end of each line: [east, north, altitude] in metres; goes with to_points_m."
    )
    to_points_m: list[Point3] | None = Field(
        None, description="The other end of each line: [east, north, altitude] in metres; goes with from_points_m."
    )

    @model_validator(mode="after")
    def _one_form_of_pairs(self) -> Self:
        arrays = (self.from_points_m, self.to_points_m)
        if (self.pairs is not None) == any(array is not None for array in arrays):
            raise ValueError("Give either pairs or both from_points_m and to_points_m.")
        if self.pairs is None and any(array is None for array in arrays):
            raise ValueError("from_points_m and to_points_m go together.")
        lengths = {len(points) for points in (self.pairs, *arrays) if points is not None}
        if len(lengths) > 1:
            raise ValueError("from_points_m and to_points_m must be equally long.")
        if lengths == {0}:
            raise ValueError("At least one pair of points is needed.")
        return self


class LinesOfSightIn(LinesOfSightParameters):
    """The same on a DEM of the service."""

    model_config = ConfigDict(json_schema_extra={"examples": [PAIRS, ARRAYS]})

    dem_id: DemId
