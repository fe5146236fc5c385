"""What worker processes can be asked to do, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from service.products import PRODUCTS

from .context import Task, TaskContext
from .dems import draw_hillshade, read_uploaded_dem
from .epochs import check_epochs
from .lines_of_sight import calculate_lines_of_sight, check_lines_of_sight
from .maps import check_map, draw_layer, map_task
from .safety_bubbles import calculate_safety_bubbles, check_safety_bubbles

__all__ = ["TASKS", "Task", "TaskContext"]

TASKS: Mapping[str, Task] = MappingProxyType(
    {
        "read-dem": read_uploaded_dem,
        "draw-hillshade": draw_hillshade,
        "check-map": check_map,
        **{name: map_task(product) for name, product in PRODUCTS.items()},
        "draw-layer": draw_layer,
        "check-epochs": check_epochs,
        "check-lines-of-sight": check_lines_of_sight,
        "lines-of-sight": calculate_lines_of_sight,
        "check-safety-bubbles": check_safety_bubbles,
        "safety-bubbles": calculate_safety_bubbles,
    }
)
