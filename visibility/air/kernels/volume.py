"""The control volume's kernel: who is in sight in each voxel, and the dilution of precision there."""

import math
from typing import Any, NamedTuple

import numpy as np
from numba import prange

from compiled.options import parallel_kernel, scalar_kernel
from visibility.air.kernels.columns import COLUMN_ROWS, MAYBE, SURE, count_of, fill_column, same_set, set_between
from visibility.dilution.kernels.dop import dilutions

__all__ = ["Layers", "Voxels", "volume_layers"]


class Layers(NamedTuple):
    """altitudes_m: (layers,) float64; above_ground: whether they count from the ground of each post."""

    altitudes_m: Any
    above_ground: bool


class Voxels(NamedTuple):
    """seen, unknown: (layers, rows, cols, words) uint64; dilution: (layers, rows, cols) float32, empty = not asked."""

    seen: Any
    unknown: Any
    dilution: Any


@scalar_kernel
def _all_distant(words, distant):
    """Whether every anchor of a set is distant, so that its dilution is the same everywhere."""
    for a in range(distant.shape[0]):
        if (words[a >> 6] >> np.uint64(a & 63)) & np.uint64(1) != 0 and not distant[a]:
            return False
    return True


@parallel_kernel
def volume_layers(surfaces, window, layers, antennas, sources, kind, measure, out):
    """Fill Voxels over the posts of a Window.

    Bits of ``unknown`` are anchors that are neither in sight nor hidden for certain; the dilution is NaN where there
    are any. surfaces, antennas: see fill_column; sources: those of the dilution.
    """
    seen, unknown, dilution = out
    altitudes_m, above_ground = layers
    ground_m, distant = surfaces.ground_m, sources.distant
    anchors, words = antennas.places.shape[0], seen.shape[3]
    for row in prange(seen.shape[1]):
        table = np.empty((COLUMN_ROWS, anchors))
        sure, maybe, last = np.empty(words, np.uint64), np.empty(words, np.uint64), np.empty(words, np.uint64)
        grid_row = window.first_row + row
        north = window.origin_north_m - grid_row * window.cell_north_m
        for col in range(seen.shape[2]):
            grid_col = window.first_col + col
            east = window.origin_east_m + grid_col * window.cell_east_m
            known = fill_column(table, surfaces, grid_row, grid_col, (east, north), antennas)
            ground = ground_m[grid_row, grid_col] if above_ground else np.float32(0.0)
            value = math.nan
            reusable = False
            for layer in range(altitudes_m.shape[0]):
                # in float32, as receivers of the minimum visible altitude are
                altitude = float(ground + np.float32(altitudes_m[layer]))
                set_between(table, altitude, altitude, SURE, True, sure)
                if math.isnan(altitude):
                    maybe[:] = np.uint64(0)
                    for a in range(anchors):
                        maybe[a >> 6] |= np.uint64(1) << np.uint64(a & 63)
                elif known:
                    maybe[:] = sure
                else:
                    set_between(table, altitude, altitude, MAYBE, True, maybe)
                for word in range(words):
                    seen[layer, row, col, word] = sure[word]
                    unknown[layer, row, col, word] = maybe[word] & ~sure[word]
                if dilution.shape[0] == 0:
                    continue
                if not same_set(sure, maybe) or math.isnan(altitude):
                    dilution[layer, row, col] = np.nan
                    continue
                if not (reusable and same_set(sure, last)):
                    value = math.inf
                    if count_of(sure) > 0:
                        value, _ = dilutions((east, north, altitude), sources, sure, kind, measure)
                    last[:] = sure
                    reusable = _all_distant(sure, distant)
                dilution[layer, row, col] = value
