"""What a limit on positioning bars is drawn on the map of a path."""

import numpy as np

from planning.paths import Reason
from service.drawing.class_map import UNDECIDED
from service.products.paths.picture import draw_path, path_classes
from tests.service.small_paths import at, small_path


def test_ground_that_too_few_anchors_see_is_drawn_where_no_range_reaches():
    """Two anchors of short range at both ends: what lies further from both is what cuts the way."""
    reach_m, ends = 150.0, (at(45.0, 430.0), at(470.0, 70.0))
    anchors = [
        {"id": name, **place, "above_ground_m": 60.0, "max_range_m": reach_m}
        for name, place in zip("PQ", ends, strict=True)
    ]
    cut = small_path(ends, anchors=anchors, no_go=[], limits={"min_anchors": 1})
    assert cut.answer.unreachable.reason == Reason.ANCHORS
    classes, numbers, _ = path_classes(cut)
    drawn = numbers == [kind.label for kind in classes].index("too few in sight")
    grid = cut.grid
    east_m, north_m = np.meshgrid(
        grid.origin_east_m + grid.cell_east_m * np.arange(grid.cols),
        grid.origin_north_m - grid.cell_north_m * np.arange(grid.rows),
    )
    nearest_m = np.min([np.hypot(east_m - end["east_m"], north_m - end["north_m"]) for end in ends], axis=0)
    cell_m = 2.0 * np.hypot(grid.cell_east_m, grid.cell_north_m)
    others = (numbers == len(classes) - 1) | (numbers == UNDECIDED)
    assert (drawn | others)[nearest_m > reach_m + cell_m].all()
    assert not drawn[nearest_m < 60.0].any()
    legend = draw_path(cut).axes[0].get_legend()
    assert any(text.get_text().startswith("too few in sight") for text in legend.get_texts())
