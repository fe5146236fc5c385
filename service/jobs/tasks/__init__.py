"""What worker processes can be asked to do, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from .context import Task, TaskContext
from .dems import read_uploaded_dem
from .visibility_maps import calculate_visibility_map, check_visibility_map, draw_layer

__all__ = ["TASKS", "Task", "TaskContext"]

TASKS: Mapping[str, Task] = MappingProxyType(
    {
        "read-dem": read_uploaded_dem,
        "check-visibility-map": check_visibility_map,
        "visibility-map": calculate_visibility_map,
        "draw-layer": draw_layer,
    }
)
