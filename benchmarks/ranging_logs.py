"""Published ranging logs as Sightline reads them: ``python -m benchmarks.ranging_logs labyrinth FOLDER OUT``.

Writes log.csv and anchors.csv for ``sightline detect`` into OUT.
"""

from __future__ import annotations

import argparse
import csv
import math
from pathlib import Path

from service.range_log import COLUMNS

__all__ = ["labyrinth", "write_labyrinth"]


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
    out.mkdir(parents=True, exist_ok=True)
    anchors, rows = labyrinth(folder)
    _write(out / "anchors.csv", ["id", "east_m", "north_m"], anchors)
    _write(out / "log.csv", list(COLUMNS), rows)


def _write(path: Path, columns: list[str], rows: list[dict[str, float | str]]) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, columns)
        writer.writeheader()
        writer.writerows(rows)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", choices=["labyrinth"])
    parser.add_argument("folder", type=Path)
    parser.add_argument("out", type=Path)
    arguments = parser.parse_args()
    write_labyrinth(arguments.folder, arguments.out)
