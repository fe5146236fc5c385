"""What worker processes can be asked to do, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from .context import Task, TaskContext
from .dems import read_uploaded_dem
from .lines_of_sight import calculate_lines_of_sight, check_lines_of_sight
from .visibility_maps import calculate_visibility_map, check_visibility_map, draw_layer

__all__ = ["TASKS", "Task", "TaskContext"]

TASKS: Mapping[str, Task] = MappingProxyType(
    {
        "read-dem": read_uploaded_dem,
        "check-visibility-map": check_visibility_map,
        "visibility-map": calculate_visibility_map,
        "draw-layer": draw_layer,
        "check-lines-of-sight": check_lines_of_sight,
        "lines-of-sight": calculate_lines_of_sight,
    }
)
