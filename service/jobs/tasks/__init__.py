"""What worker processes can be asked to do, by name."""

from collections.abc import Mapping
from types import MappingProxyType

from service.products.lines_of_sight.task import calculate_lines_of_sight, check_lines_of_sight
from service.products.registry import PRODUCTS
from service.products.safety_bubbles.task import calculate_safety_bubbles, check_safety_bubbles

from .context import Task, TaskContext
from .dems import draw_hillshade, read_uploaded_dem
from .epochs import check_epochs
from .maps import check_map, draw_layer, map_task

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
