"""Dilution of precision by the textbook: a design matrix with one row per range, and numpy's inverse."""

import numpy as np


def covariance(anchors_m, receiver_m, kind, variances_m2=None, surface_normal=None, reference=0):
    """(covariance of position (3, 3), variance of the clock or 0) of weighted least squares; ranges to all anchors.

    kind "tdoa" differences every arrival with that of the anchor ``reference``, and weighs with the inverse of those
    differences' full covariance. Raises numpy.linalg.LinAlgError where there is no inverse.
    """
    to_anchor_m = np.asarray(anchors_m, float) - np.asarray(receiver_m, float)
    directions = to_anchor_m / np.linalg.norm(to_anchor_m, axis=1)[:, None]
    ranges_m2 = np.diag(np.ones(len(directions)) if variances_m2 is None else np.asarray(variances_m2, float))
    along = np.eye(3) if surface_normal is None else tangents(surface_normal)
    design = -directions @ along
    if kind == "pseudorange":
        design = np.column_stack([design, np.ones(len(design))])
    if kind == "tdoa":
        others = [a for a in range(len(design)) if a != reference]
        differences = np.eye(len(design))[others] - np.eye(len(design))[reference]
        design, ranges_m2 = differences @ design, differences @ ranges_m2 @ differences.T
    solved = np.linalg.inv(design.T @ np.linalg.inv(ranges_m2) @ design)
    unknowns = along.shape[1]
    clock_m2 = solved[unknowns, unknowns] if kind == "pseudorange" else 0.0
    return along @ solved[:unknowns, :unknowns] @ along.T, clock_m2


def tangents(surface_normal):
    """(3, 2) two directions across a normal, from the singular value decomposition."""
    return np.linalg.svd(np.asarray(surface_normal, float)[None])[2][1:].T


def dilutions(anchors_m, receiver_m, kind, surface_normal=None):
    """(gdop, pdop, hdop, vdop, tdop)."""
    q, clock = covariance(anchors_m, receiver_m, kind, None, surface_normal)
    return np.sqrt([np.trace(q) + clock, np.trace(q), q[0, 0] + q[1, 1], q[2, 2], clock])
