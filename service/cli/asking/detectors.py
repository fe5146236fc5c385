"""What ``sightline detect`` is told: settings of the detector, how the log is written, a map to look at."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Literal

from service.errors import RequestError

from .cover import BARE, CoverOptions
from .doubts import TRUSTING, DoubtOptions
from .options import GROUP, RadioName, Reading, option, told

if TYPE_CHECKING:
    from detection import Calibration, DetectorSettings, RangeEpoch, RangingAnchor
    from navigation import Estimator
    from planning.watching import MapDetector
    from service.files.logs.form import LogForm
    from service.live.settings import DetectorSettingsIn
    from service.parts.areas import AnyArea
    from service.parts.radios import RadioIn
    from terrain import ElevationGrid

__all__ = ["DetectorOptions", "LogOptions", "MapOptions", "ReplayOptions"]

NO_RADIOS: Mapping[str, RadioIn] = MappingProxyType({})


@GROUP
@dataclass(frozen=True, slots=True)
class DetectorOptions:
    """Settings of the detector, as a session's request has them."""

    dimension: Annotated[int | None, option("Whether heights matter. (default 3)", "2|3")] = None
    range_sigma_m: Annotated[
        float | None, option("One-sigma error of a range. (default 0.1)", "M", "--range-sigma")
    ] = None
    geometric_tolerance_m: Annotated[
        float | None, option("Geometric tolerance in place of k sigmas, metres.", "M", "--tolerance")
    ] = None
    max_speed_m_per_s: Annotated[
        float | None, option("Of the rover, metres per second. (default 10)", "M/S", "--max-speed")
    ] = None
    more: Annotated[
        tuple[str, ...], option("Any other setting of the detector. Repeatable.", "NAME=VALUE", "--set")
    ] = ()

    def asked(self) -> DetectorSettingsIn:
        """The settings in the words of a request. Raises RequestError."""
        from pydantic import ValidationError

        from service.live.settings import DetectorSettingsIn
        from service.parts.sentences import sentence_of

        fields = told(self)
        fields.pop("more", None)
        for text in self.more:
            name, equals, value = text.partition("=")
            if not equals or name.strip() not in DetectorSettingsIn.model_fields:
                known = ", ".join(DetectorSettingsIn.model_fields)
                raise RequestError(f"--set {text!r} is not of the form NAME=VALUE with a NAME out of {known}.")
            try:
                fields[name.strip()] = json.loads(value)
            except (ValueError, RecursionError):
                fields[name.strip()] = value.strip()  # a word, which needs no quotes here
        try:
            return DetectorSettingsIn.model_validate(fields)
        except ValidationError as error:
            raise RequestError(f"The settings: {sentence_of(error)}") from error


@GROUP
@dataclass(frozen=True, slots=True)
class ReplayOptions:
    """What a log that lies there as a whole can be asked for besides."""

    calibrate: Annotated[
        Literal["offset", "scale", "anchors"] | None,
        option("Estimate, apply and tell what ranges are off: one offset, one scale, or an offset of each anchor."),
    ] = None

    def calibrated(
        self, anchors: Sequence[RangingAnchor], epochs: Sequence[RangeEpoch], settings: DetectorSettings
    ) -> Calibration | None:
        """What ranges are off, where that was asked for. Raises RequestError where the log does not tell."""
        from detection import calibrate

        if self.calibrate is None:
            return None
        found = calibrate(anchors, epochs, settings, self.calibrate)
        if found is None:
            raise RequestError(
                f"--calibrate {self.calibrate}: the log does not tell; it takes epochs of more ranges than a place "
                "needs, from many places."
            )
        return found


@GROUP
@dataclass(frozen=True, slots=True)
class LogOptions:
    """How the log is written."""

    epoch: Annotated[float, option("Ranges within so many seconds belong together; 0: of equal time.", "S")] = 0.0
    columns: Annotated[
        str | None, option("Columns that a table names otherwise: time_s=%time,range_m=dist.", "NAME=COLUMN,…")
    ] = None
    time_unit: Annotated[str | None, option("Of time_s in a table: s, ms, us, ns.", "UNIT")] = None
    range_unit: Annotated[str | None, option("Of range_m and sigma_m in a table: m, mm, cm, km, ft.", "UNIT")] = None
    date_order: Annotated[str | None, option("Of dates like 03/04/2024: dmy, mdy.", "ORDER")] = None
    map: Annotated[Path | None, option("What holds what, as sightline log LOG --mapping prints it.", "FILE")] = None

    def form(self) -> LogForm:
        """What was told of how the log is written; single options before the file. Raises RequestError."""
        from service.files.logs.form import PLAIN, read_map

        filed = PLAIN if self.map is None else read_map(self.map)
        return replace(
            filed,
            columns={**filed.columns, **self._names()},
            time_unit=self.time_unit or filed.time_unit,
            range_unit=self.range_unit or filed.range_unit,
            date_order=self.date_order or filed.date_order,
        )

    def _names(self) -> dict[str, str]:
        text, columns = self.columns or "", {}
        for part in text.split(",") if text else ():
            name, equals, column = part.partition("=")
            if not equals:
                raise RequestError(f"--columns {text!r} is not of the form NAME=COLUMN,NAME=COLUMN.")
            columns[name.strip()] = column.strip()
        return columns


@GROUP
@dataclass(frozen=True, slots=True)
class MapOptions:
    """A map that the replay looks at."""

    dem: Annotated[
        str | None, option("A DEM: it foretells sight and the ground's height. Anchors are in its CRS.", "FILE")
    ] = None
    antenna: Annotated[float, option("Of the rover, above the ground.", "M")] = 1.5
    dem_sigma: Annotated[float, option("One-sigma error of the DEM's heights.", "M")] = 3.0
    dem_shift: Annotated[float | None, option("One-sigma error of where it lies. (default half a cell)", "M")] = None
    radio: Annotated[
        RadioName | None,
        option("The radio of anchors that name none: what is foretold is then of the signal.", "NAME"),
    ] = None
    cover: CoverOptions = BARE

    def grid(
        self, frame: Mapping[str, float] | None, within: AnyArea | None, margin_m: float | None, doubts: DoubtOptions
    ) -> ElevationGrid | None:
        """The DEM, where one was named, with what stands on it. Raises RequestError, TerrainError."""
        if self.dem is None:
            if within is not None or margin_m is not None:
                raise RequestError("An area is one of a DEM: give --dem too, or leave out the area and --margin.")
            if doubts.part():
                raise RequestError("Doubts are about a DEM: give --dem too, or leave out --doubts.")
            if self.radio is not None or not self.cover.bare:
                raise RequestError("Radios, buildings and trees stand on a DEM: give --dem too, or leave them out.")
            return None
        if frame is not None:
            raise RequestError("With --dem give the anchors in metres of the DEM's CRS, not in degrees.")
        return Reading(cover=self.cover).read(self.dem, within, margin_m)

    def detector(
        self,
        grid: ElevationGrid,
        anchors: Sequence[RangingAnchor],
        settings: DetectorSettings,
        within: AnyArea | None = None,
        estimator: Estimator | None = None,
        doubts: DoubtOptions = TRUSTING,
        radios: Mapping[str, RadioIn] = NO_RADIOS,
    ) -> MapDetector:
        """The detector that looks at the DEM; within: only where the rover is in this area.

        estimator: a fresh filter that goes along. doubts: of earlier drives; what of them is passed over is among its
        warnings. radios: by anchor, of those that name one. Raises RequestError, WatchError.
        """
        from planning.watching import GroundErrors, MapDetector
        from service.parts.doubts import DoubtParameters, doubts_by_anchor
        from service.parts.map_area import area_shape

        from .products import request_of_fields

        errors = GroundErrors(dem_sigma_m=self.dem_sigma, shift_sigma_m=self.dem_shift)
        asked = request_of_fields(doubts.part(), DoubtParameters).doubts
        taken, told = doubts_by_anchor(grid, asked, {one.id: (one.east_m, one.north_m) for one in anchors})
        shape = area_shape(grid, within)
        heard = {one.id: radios.get(one.id) or self._named() for one in anchors}
        found = MapDetector(
            *(grid, anchors, settings, self.antenna, errors, None, shape, estimator, taken),
            {name: radio.radio() for name, radio in heard.items() if radio is not None},
        )
        found.warnings += told
        return found

    def _named(self) -> RadioIn | None:
        from service.parts.radios import RadioIn

        return None if self.radio is None else RadioIn.model_validate(self.radio)
