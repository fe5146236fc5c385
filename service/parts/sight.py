"""What every map asks about sight lines: anchors, and how lines are calculated."""

from __future__ import annotations

from collections import Counter
from typing import Annotated, Any, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from service.parts.anchors import AnchorIn, AntennaIn
from service.parts.points import Positive, StrictModel

__all__ = ["CurvatureChoice", "CurvatureIn", "SightParameters"]


class CurvatureIn(StrictModel):
    """Curvature given by numbers: ground at distance d is lowered by d²/(2·refraction_k·radius_m)."""

    radius_m: Positive = Field(description="Mean radius of the body, metres.")
    refraction_k: Positive = Field(
        1.0, description="Effective-radius factor k, no unit: 4/3 for radio on Earth, 1 without air."
    )


def _word_or_numbers(value: Any) -> str:
    return "word" if isinstance(value, str) else "numbers"


CurvatureChoice = Annotated[
    Annotated[Literal["auto", "flat"], Tag("word")] | Annotated[CurvatureIn, Tag("numbers")],
    Discriminator(_word_or_numbers),
]


class SightParameters(StrictModel):
    """Anchors, and how sight lines to them are calculated."""

    anchors: list[AnchorIn] = Field([], description="The anchors, with unique ids.")
    mode: Literal["fast", "exact"] = Field(
        "fast", description="fast: the column sweep, with its stated error; exact: every edge that the line crosses."
    )
    unknown: Literal["unknown", "open", "blocked"] = Field(
        "unknown", description="What a sight line over unknown ground is, unless known ground blocks it already."
    )
    curvature: CurvatureChoice = Field(
        "auto", description="auto: what the DEM's CRS implies (flat without a CRS); flat: none; or numbers."
    )

    def near_sources(self) -> tuple[AntennaIn, ...]:
        """All that has a place over the DEM, in the order of answers."""
        return tuple(self.anchors)

    @model_validator(mode="after")
    def _unique_ids(self) -> Self:
        ids = [anchor.id for anchor in self.near_sources()]
        twice = sorted(id for id, times in Counter(ids).items() if times > 1)
        if twice:
            raise ValueError(f"Anchor ids must be unique; repeated: {', '.join(twice[:5])}.")
        return self
