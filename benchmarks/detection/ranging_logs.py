"""Published ranging logs as Sightline reads them: ``python -m benchmarks.detection.ranging_logs labyrinth FOLDER OUT``.

Writes log.csv and anchors.csv for ``sightline detect`` into OUT; of starloc one pair per tag, tag-1.csv for log.csv.
"""

from __future__ import annotations

import argparse
import csv
import math
import sys
from pathlib import Path

from scipy.io.matlab import MatReadError

from benchmarks.detection.measured_ranges import RangeLog, plaza, starloc
from service.files.range_log import COLUMNS

__all__ = ["labyrinth", "write_labyrinth", "write_log"]

# what is published, and what of it is read
PLACES = {
    "labyrinth": "the folder with Indoor_UWB_Input.txt",
    "plaza": "a file such as Plaza1.mat",
    "starloc": "the folder of a sequence, with uwb.csv",
}


def labyrinth(folder: Path) -> tuple[list[dict[str, float | str]], list[dict[str, float | str]]]:
    """(anchors, rows of a log) of the Labyrinth data set: ranges of 4 anchors, wheel odometry, two dimensions.

    The wheels' displacement is dead-reckoned in a level frame that starts with the rover's own axes.
    """
    anchors: dict[str, dict[str, float | str]] = {}
    rows: list[dict[str, float | str]] = []
    heading_rad, before_s = 0.0, math.nan
    for line in (folder / "Indoor_UWB_Input.txt").read_text(encoding="utf-8").splitlines():
        kind, *numbers = line.split()
        time_s = float(numbers[0])
        if kind == "range2":
            name = f"U{int(float(numbers[5]))}"
            anchors[name] = {"id": name, "east_m": float(numbers[3]), "north_m": float(numbers[4])}
            measured = {"range_m": float(numbers[1]), "sigma_m": math.sqrt(float(numbers[2]))}
            rows.append({"time_s": time_s, "anchor_id": name, **measured})
        elif kind == "odom2diff":
            right_m_per_s, left_m_per_s, across_m = float(numbers[1]), float(numbers[2]), float(numbers[4])
            duration_s = time_s - before_s
            before_s = time_s
            if math.isnan(duration_s):
                continue
            turn_rad = (right_m_per_s - left_m_per_s) / across_m * duration_s
            forward_m = 0.5 * (right_m_per_s + left_m_per_s) * duration_s
            middle_rad = heading_rad + 0.5 * turn_rad
            heading_rad += turn_rad
            wheels = {"wheel_x_m": forward_m * math.cos(middle_rad), "wheel_y_m": forward_m * math.sin(middle_rad)}
            rows.append({"time_s": time_s, "duration_s": duration_s, **wheels})
    # the file holds all ranges, then all odometry; the rover got them by time
    rows.sort(key=lambda row: (row["time_s"], "anchor_id" in row))
    return [anchors[name] for name in sorted(anchors)], rows


def write_labyrinth(folder: Path, out: Path) -> None:
    """The same as files."""
    anchors, rows = labyrinth(folder)
    out.mkdir(parents=True, exist_ok=True)
    _write(out / "anchors.csv", ["id", "east_m", "north_m"], anchors)
    _write(out / "log.csv", list(COLUMNS), rows)


def write_log(log: RangeLog, out: Path, name: str = "log") -> None:
    """A log with its truth left out, a range a row, each at its own time, as files."""
    out.mkdir(parents=True, exist_ok=True)
    columns = ["id", "east_m", "north_m", "altitude_m"]
    _write(
        out / "anchors.csv",
        columns,
        [{column: getattr(anchor, column) for column in columns} for anchor in log.anchors],
    )
    rows: list[dict[str, float | str]] = []
    for epoch in log.epochs:
        motion = epoch.odometry
        if motion is not None and motion.wheel_m is not None:
            along_m, across_m = motion.wheel_m
            wheels = {"duration_s": motion.duration_s, "wheel_x_m": along_m, "wheel_y_m": across_m}
            heading = {} if motion.heading_rad is None else {"heading_deg": math.degrees(motion.heading_rad)}
            rows.append({"time_s": epoch.time_s, **wheels, **heading})
        for measured in epoch.ranges:
            time_s = epoch.time_s if measured.time_s is None else measured.time_s
            sigma = {} if measured.sigma_m is None else {"sigma_m": measured.sigma_m}
            rows.append({"time_s": time_s, "anchor_id": measured.anchor_id, "range_m": measured.range_m, **sigma})
    _write(out / f"{name}.csv", list(COLUMNS), rows)


def _write(path: Path, columns: list[str], rows: list[dict[str, float | str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.detection.ranging_logs", description=__doc__)
    parser.add_argument("data", choices=list(PLACES))
    parser.add_argument("place", type=Path, help=f"{', '.join(f'of {data}: {what}' for data, what in PLACES.items())}")
    parser.add_argument("out", type=Path)
    arguments = parser.parse_args()
    data, place = arguments.data, arguments.place
    try:
        if data == "labyrinth":
            write_labyrinth(place, arguments.out)
        elif data == "plaza":
            write_log(plaza(place), arguments.out)
        else:
            for log in starloc(place):
                write_log(log, arguments.out, f"tag-{log.name.rpartition(' ')[2]}")
    except OSError as error:
        parser.error(f"{error.filename or place}: {error.strerror or error}. What {data} takes is {PLACES[data]}.")
    except (MatReadError, ValueError, KeyError, IndexError) as error:
        parser.error(f"{place} is no data of {data}, which takes {PLACES[data]} ({type(error).__name__}: {error}).")
    return 0


if __name__ == "__main__":
    sys.exit(main())
