"""What worker processes can be asked to do, by name."""

from __future__ import annotations

from collections.abc import Mapping

from service.products.product import Product

from .context import Task, TaskContext
from .dems import draw_hillshade, read_uploaded_dem, write_dem_level
from .epochs import check_epochs
from .ground import plan_ground, read_ground, tell_coverage
from .probes import answer_probe, answer_profiles
from .products import calculation_of, check_request, draw_layer

__all__ = ["Task", "TaskContext", "tasks_for"]


def tasks_for(products: Mapping[str, Product]) -> Mapping[str, Task]:
    """All tasks of a service with these products; a job's task is called as its product."""
    return {
        "read-dem": read_uploaded_dem,
        "draw-hillshade": draw_hillshade,
        "write-level": write_dem_level,
        "plan-ground": plan_ground,
        "read-ground": read_ground,
        "tell-coverage": tell_coverage,
        "probe": answer_probe,
        "profiles": answer_profiles,
        "check-request": check_request,
        "draw-layer": draw_layer,
        "check-epochs": check_epochs,
        **{name: calculation_of(product) for name, product in products.items()},
    }
