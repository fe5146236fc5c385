"""What a visibility map is asked for, apart from the DEM."""

from __future__ import annotations

from typing import Annotated, Any, Literal, Self

from pydantic import ConfigDict, Discriminator, Field, Tag, model_validator

from .anchors import AnchorIn
from .points import Metres, NotNegativeMetres, StrictModel

__all__ = ["CurvatureIn", "VisibilityMapParameters"]

DEFAULT_RECEIVER_ABOVE_GROUND_M = 1.5


class CurvatureIn(StrictModel):
    """Curvature given by numbers: ground at distance d is lowered by d²/(2·refraction_k·radius_m)."""

    radius_m: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)] = Field(
        description="Mean radius of the body, metres."
    )
    refraction_k: Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0)] = Field(
        1.0, description="Effective-radius factor k, no unit: 4/3 for radio on Earth, 1 without air."
    )


def _word_or_numbers(value: Any) -> str:
    return "word" if isinstance(value, str) else "numbers"


CurvatureChoice = Annotated[
    Annotated[Literal["auto", "flat"], Tag("word")] | Annotated[CurvatureIn, Tag("numbers")],
    Discriminator(_word_or_numbers),
]


class VisibilityMapParameters(StrictModel):
    """Anchors, receiver height and how to calculate."""

    model_config = ConfigDict(
        json_schema_extra={
            "examples": [
                {
                    "anchors": [
                        {"id": "D1", "east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 80.0},
                        {"id": "D2", "east_m": 409800.0, "north_m": 3798100.0, "altitude_m": 1612.0},
                    ],
                    "receiver_above_ground_m": 1.5,
                    "mode": "fast",
                }
            ]
        }
    )

    anchors: list[AnchorIn] = Field(min_length=1, description="The anchors, at least one, with unique ids.")
    receiver_above_ground_m: NotNegativeMetres | None = Field(
        DEFAULT_RECEIVER_ABOVE_GROUND_M,
        description="Height of the receiver's antenna above the ground of each post, metres; or give "
        "receiver_altitude_m.",
    )
    receiver_altitude_m: Metres | None = Field(
        None, description="One altitude of the receiver over all posts, metres in the DEM's vertical datum."
    )
    mode: Literal["fast", "exact"] = Field(
        "fast", description="fast: the column sweep, with its stated error; exact: every edge that the line crosses."
    )
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a sight line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    @model_validator(mode="before")
    @classmethod
    def _altitude_replaces_the_default_height(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("receiver_altitude_m") is not None:
            return {"receiver_above_ground_m": None, **given}
        return given

    @model_validator(mode="after")
    def _one_receiver_height_and_unique_ids(self) -> Self:
        if (self.receiver_above_ground_m is None) == (self.receiver_altitude_m is None):
            given = "neither was" if self.receiver_altitude_m is None else "both were"
            raise ValueError(f"Give exactly one of receiver_above_ground_m and receiver_altitude_m; {given} given.")
        ids = [anchor.id for anchor in self.anchors]
        twice = sorted({i for i in ids if ids.count(i) > 1})
        if twice:
            raise ValueError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
        return self
