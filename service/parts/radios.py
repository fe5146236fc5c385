"""Radios of anchors, and whether a request asks for sight or for enough of a signal."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from service.parts.points import StrictModel
from visibility import SignalError
from visibility.signal import RADIOS, Radio

__all__ = ["RadioIn", "RadioName", "Sight", "SightChoice"]

Decibels = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-400.0, le=400.0)]
Hertz = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=1e12)]
RadioName = Literal["uwb", "2.4GHz", "868MHz", "915MHz", "gnss-l1"]
Sight = Annotated[
    Literal["visible", "usable"],
    Field(
        description="visible: what is in sight; usable: what arrives with enough power, for which every anchor needs a "
        "radio. Radios are not looked at for what is visible."
    ),
]


class RadioIn(StrictModel):
    """The budget of a radio link: one that is known by name, numbers, or the first with some of the second.

    The name alone may stand in its place.
    """

    preset: RadioName | None = Field(None, description="A budget known by name; numbers given besides replace its own.")
    frequency_hz: Hertz | None = Field(None, description="Carrier, 30 MHz to 100 GHz, in Hz.")
    transmit_power_dbm: Decibels | None = Field(None, description="Power into the antenna, dBm.")
    sensitivity_dbm: Decibels | None = Field(None, description="Power at which a range is still measured, dBm.")
    transmit_gain_dbi: Decibels | None = Field(None, description="Gain of the sending antenna, dBi.")
    receive_gain_dbi: Decibels | None = Field(None, description="Gain of the receiving antenna, dBi.")
    losses_db: Annotated[Decibels, Field(ge=0.0)] | None = Field(
        None, description="What cables, bodies and polarisation take, dB."
    )
    spread_db: Annotated[Decibels, Field(ge=0.0)] | None = Field(
        None, description="One-sigma of what the models leave out, dB."
    )
    polarization: Literal["vertical", "horizontal"] | None = Field(None, description="Of the wave.")

    def radio(self) -> Radio:
        """The same as the library takes it. Raises SignalError."""
        given = {name: value for name, value in self if value is not None and name != "preset"}
        if self.preset is not None:
            return replace(RADIOS[self.preset], **given)
        missing = [name for name in ("frequency_hz", "transmit_power_dbm", "sensitivity_dbm") if name not in given]
        if missing:
            raise SignalError(f"A radio without a preset needs {', '.join(missing)}.")
        return Radio(**given)

    @model_validator(mode="before")
    @classmethod
    def _by_its_name(cls, given: Any) -> Any:
        return {"preset": given} if isinstance(given, str) else given

    @model_validator(mode="after")
    def _is_one(self) -> Self:
        try:
            self.radio()
        except SignalError as error:
            raise ValueError(str(error)) from error
        return self


class SightChoice(StrictModel):
    """Whether sight decides what a request is about, or the signal; where that is not known, it is refused here.

    sight_alone: why only sight can be asked for; None where signals are known.
    """

    sight_alone: ClassVar[str | None] = None

    sight: Sight = "visible"

    @property
    def usable(self) -> bool:
        """Whether the signal decides."""
        return self.sight == "usable"

    @property
    def in_words(self) -> str:
        """What an anchor is called that counts."""
        return "usable" if self.usable else "in sight"

    def without_radio(self) -> list[str]:
        """Ids of what is ranged to, as far as nothing is known of its signal."""
        return []

    @model_validator(mode="after")
    def _signals_are_known(self) -> Self:
        if not self.usable:
            return self
        if self.sight_alone is not None:
            raise ValueError(f"What is usable cannot be asked for here: {self.sight_alone} Ask for visible.")
        silent = self.without_radio()
        if silent:
            raise ValueError(f"What is usable is not known without a radio: {', '.join(silent[:5])}.")
        return self
