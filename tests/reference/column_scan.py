"""Slow obvious oracle for morphing maps: a column of air sampled every few centimetres, numpy's inverse at each sample.

Imports nothing of ours. An anchor is a row east, north, altitude, or a unit direction where it is distant; it is in
sight from its lowest altitude upward, if limits allow: range from (min, max) and elevation at most (tangent).
"""

import numpy as np


def seen_at(altitudes_m, lowest_m, anchors, distant, place, limits):
    """(samples, anchors) bool."""
    seen = altitudes_m[:, None] >= lowest_m
    for a, limit in enumerate(limits):
        if limit is None or distant[a]:
            continue
        least_m, most_m, steepest = limit
        across_m = np.hypot(anchors[a, 0] - place[0], anchors[a, 1] - place[1])
        rise_m = altitudes_m - anchors[a, 2]
        range_m = np.hypot(across_m, rise_m)
        seen[:, a] &= (range_m >= least_m) & (range_m <= most_m)
        if steepest < np.inf:
            seen[:, a] &= rise_m <= steepest * across_m
    return seen


def dilution_of(altitudes_m, seen, anchors, distant, place, kind, name):
    """(samples,) one dilution of each sample's visible set; inf = no fix."""
    here = np.column_stack([np.full(len(altitudes_m), place[0]), np.full(len(altitudes_m), place[1]), altitudes_m])
    away = np.where(distant[None, :, None], anchors, anchors - here[:, None, :])
    unit = away / np.linalg.norm(away, axis=2, keepdims=True)
    clock = kind != "ranging"
    rows = np.concatenate([unit, np.ones((*unit.shape[:2], 1))], axis=2) if clock else unit
    rows = rows * seen[:, :, None]
    normal = rows.transpose(0, 2, 1) @ rows
    fixes = (seen.sum(axis=1) >= rows.shape[2]) & (np.linalg.det(normal) > 1e-13)
    variances = np.full((len(altitudes_m), 4), np.inf)
    if fixes.any():
        inverse = np.linalg.inv(normal[fixes])
        diagonal = np.diagonal(inverse, axis1=1, axis2=2)
        variances[fixes] = 0.0
        variances[np.flatnonzero(fixes)[:, None], np.arange(diagonal.shape[1])] = diagonal
    if kind == "tdoa":
        variances[:, 3] = 0.0
    parts = {"gdop": [0, 1, 2, 3], "pdop": [0, 1, 2], "hdop": [0, 1], "vdop": [2], "tdop": [3]}
    return np.sqrt(variances[:, parts[name]].sum(axis=1))


def runs(flags):
    """(start, stop) of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(int)))
    return list(zip(edges[::2], edges[1::2], strict=True))
