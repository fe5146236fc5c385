"""The table of a planned path, ``path.csv`` of ``sightline plan``, as a trajectory."""

from __future__ import annotations

import csv
from pathlib import Path

from pydantic import JsonValue

from planning.questions.models import NavigationModel
from service.errors import RequestError
from service.products.paths.calculate import VERTEX_COLUMNS

__all__ = ["filter_of_a_plan", "planned_path"]

COLUMNS = {f"{name.removesuffix('_rad')}_deg" if name.endswith("_rad") else name for name in VERTEX_COLUMNS}


def filter_of_a_plan() -> dict[str, JsonValue]:
    """The fields of a bubble's request with which it foresees what a plan does unless it is told otherwise."""
    model = NavigationModel()
    return {
        "ranging_interval_s": model.interval_s,
        "initial_position_sigma_m": model.initial_sigma_m,
        "initial_velocity_sigma_m_per_s": model.initial_velocity_sigma_m_per_s,
        "ground_sigma_m": model.ground_sigma_m,
        "motion": {
            "horizontal_m2_per_s3": model.motion.east_m2_per_s3,
            "up_m2_per_s3": model.motion.up_m2_per_s3,
        },
        "on_ground": True,
    }


def planned_path(path: Path) -> tuple[list[dict[str, float]], list[float]] | None:
    """(places, seconds) of such a table; None where the file is something else. Raises RequestError.

    Its altitudes are the ground's, and left out: where the antenna is above it, the table does not say.
    """
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = csv.DictReader(file, strict=True)
            if not set(rows.fieldnames or ()) >= COLUMNS:
                return None
            told = [(float(row["east_m"]), float(row["north_m"]), float(row["time_s"])) for row in rows]
    except UnicodeDecodeError:
        return None
    except OSError as error:
        raise RequestError(f"The path file {str(path)!r} cannot be read: {error.strerror}.") from error
    except (csv.Error, ValueError, TypeError) as error:
        raise RequestError(f"The path file {path.name} is not as sightline plan writes it: {error}.") from error
    if not told:
        raise RequestError(f"The path file {path.name} holds no points.")
    return [{"east_m": east_m, "north_m": north_m} for east_m, north_m, _ in told], [at_s for _, _, at_s in told]
