"""The filter that goes along with ``sightline detect``, and the inertial readings that one of them takes."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from service.errors import RequestError

from .options import GROUP, option

if TYPE_CHECKING:
    from detection import DetectorSettings, RangingAnchor
    from navigation import Estimator
    from service.files.drives.rows import DriveRows
    from service.files.logs.form import LogForm
    from service.live.epoch_logs import EpochLog
    from service.live.imu import LogReadings
    from terrain import ElevationGrid

__all__ = ["Along", "EstimatorOptions", "drive_settings"]

# of the settings of a navigation, those that a filter beside a detector has no use for
OF_NAVIGATE = frozenset({
    "align_s", "position_m", "position_sigma_m", "velocity_sigma_m_per_s", "fix_sigma_m", "fix_velocity_sigma_m_per_s",
    "least_sight", "hidden_excess_m", "antenna_above_ground_m", "gap_acceleration_m_per_s2", "gap_rate_rad_per_s",
    "epsilon", "smoother",
})  # fmt: skip


@dataclass(frozen=True, slots=True, eq=False)
class Along:
    """A fresh filter that goes along, if any, with the readings that it takes; told: what to know, sentences."""

    estimator: Estimator | None = None
    readings: LogReadings | None = None
    told: tuple[str, ...] = ()

    def warnings(self) -> tuple[str, ...]:
        """What to know, once the replay is done."""
        return self.told if self.readings is None else (*self.told, *self.readings.warnings())


@GROUP
@dataclass(frozen=True, slots=True)
class EstimatorOptions:
    """A filter that goes along with the replay."""

    estimator: Annotated[
        Literal["constant_velocity", "hypotheses", "inertial"] | None,
        option("A filter that goes along; its place, velocity and bubble go into estimates.csv."),
    ] = None
    imu_log: Annotated[
        tuple[Path, ...],
        option("For inertial: where its readings are, as navigate takes them. (default LOG) Repeatable.", "FILE"),
    ] = ()
    settings: Annotated[
        Path | None,
        option("For inertial: JSON of the unit and how it is mounted, as navigate --settings takes it.", "FILE"),
    ] = None
    lat: Annotated[
        float | None, option("For inertial: latitude of anchors in metres of no CRS. (default 45)", "DEG")
    ] = None

    def begin(
        self,
        anchors: Sequence[RangingAnchor],
        settings: DetectorSettings,
        grid: ElevationGrid | None,
        frame: Mapping[str, float] | None,
        logs: Sequence[Path],
        form: LogForm,
        read: EpochLog,
    ) -> Along:
        """The filter that was asked for. read: the epochs of the logs. frame: of anchors that came in degrees.

        Raises RequestError, StateError, MeasurementError.
        """
        from navigation import ESTIMATORS

        if self.estimator == "inertial":
            return self._inertial(anchors, settings, grid, frame, logs, form, read)
        if self.imu_log or self.settings is not None or self.lat is not None:
            raise RequestError("--imu-log, --settings and --lat go with --estimator inertial.")
        unused = f"{len(read.imu)} epochs hold inertial readings, which only --estimator inertial takes."
        told = (unused,) if read.imu else ()
        return Along(None if self.estimator is None else ESTIMATORS[self.estimator](anchors, settings), None, told)

    def _inertial(
        self,
        anchors: Sequence[RangingAnchor],
        settings: DetectorSettings,
        grid: ElevationGrid | None,
        frame: Mapping[str, float] | None,
        logs: Sequence[Path],
        form: LogForm,
        read: EpochLog,
    ) -> Along:
        from navigation.drives import InertialEstimator
        from service.files.drives.reading import read_drive
        from service.files.drives.rows import DriveRows
        from service.live.epoch_logs import SUFFIXES
        from service.live.imu import LogReadings, readings_of
        from service.live.watching import tangent_of
        from service.products.navigations.settings import NavigationSettingsIn

        from .products import request_of_fields

        if frame is not None and self.lat is not None:
            raise RequestError("Anchors in degrees tell the latitude: leave out --lat.")
        rows, from_epochs = DriveRows(), bool(read.imu) and not self.imu_log
        if from_epochs:
            times_s, forces, rates, told = readings_of(read.imu)
        elif not self.imu_log and logs[0].suffix.lower() in SUFFIXES:
            raise RequestError(f"No line of {logs[0].name} holds an imu: say --imu-log FILE, where its readings are.")
        else:
            rows = read_drive(self.imu_log or logs, form, [one.id for one in anchors])
            times_s, forces, rates = rows.readings()
            told = (*rows.told, *(("Fixes are of no use here; navigate takes them.",) if rows.fixes else ()))
        given = drive_settings(self.settings, rows)
        if from_epochs and {"force_unit", "rate_unit"} & given.keys():
            raise RequestError("The epochs tell the units of their readings: leave force_unit and rate_unit out.")
        drive = request_of_fields(given, NavigationSettingsIn).settings()
        if unused := sorted(OF_NAVIGATE & given.keys()):
            told = (*told, f"Of the settings {', '.join(unused)} are of no use here; navigate takes them.")
        latitude_deg = self.lat if frame is None else frame["lat_deg"]
        inertial = InertialEstimator(anchors, settings, drive, tangent_of(grid, anchors, latitude_deg))
        readings = LogReadings(inertial, times_s - drive.imu_late_s, forces, rates)
        readings.check_beside(read.epochs[0].time_s, read.epochs[-1].time_s)
        return Along(inertial, readings, tuple(dict.fromkeys(one for one in told if one not in read.warnings)))


def drive_settings(path: Path | None, rows: DriveRows) -> dict[str, object]:
    """What a file says of a drive, else what the log says of axes and units. Raises RequestError."""
    from service.files.csv_table import text_of

    given: dict[str, object] = {}
    if path is not None:
        try:
            given = json.loads(text_of(path, "settings file"))
        except (ValueError, RecursionError) as error:
            raise RequestError(f"The settings file {path.name} is not JSON: {error}.") from error
        if not isinstance(given, dict):
            raise RequestError(f"The settings file {path.name} holds no JSON object.")
    of_log = {name: getattr(rows, name) for name in ("axes", "force_unit", "rate_unit")}
    return {**{name: value for name, value in of_log.items() if value is not None}, **given}
