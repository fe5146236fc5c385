"""Which ranges meet in one point, the slow and obvious way: every subset, fitted from many starts by scipy."""

import itertools
import math

import numpy as np
import scipy.optimize


def circle_points(anchors_m, ranges_m, tolerance_m):
    """All points where two circles meet, by the formulas of seed 000, 2D step 3."""
    points = []
    for (i, a), (j, b) in itertools.combinations(enumerate(np.asarray(anchors_m, float)), 2):
        apart = math.dist(a, b)
        ri, rj = ranges_m[i], ranges_m[j]
        if apart == 0.0 or apart > ri + rj + tolerance_m or apart < abs(ri - rj) - tolerance_m:
            continue
        along = (ri**2 - rj**2 + apart**2) / (2 * apart)
        height = math.sqrt(max(ri**2 - along**2, 0.0))
        middle = a + along * (b - a) / apart
        across = np.array([b[1] - a[1], a[0] - b[0]]) / apart
        points += [middle + height * across, middle - height * across]
    return points


def most_circles(anchors_m, ranges_m, tolerance_m):
    """The largest number of circles through one of those points, within the tolerance (step 4)."""
    counts = [
        sum(abs(math.dist(point, a) - r) <= tolerance_m for a, r in zip(anchors_m, ranges_m, strict=True))
        for point in circle_points(anchors_m, ranges_m, tolerance_m)
    ]
    return max(counts, default=0)


def places(anchors_m, ranges_m):
    """Least-squares places of a set of ranges, found from both sides of the anchors along every axis."""
    anchors_m, ranges_m = np.asarray(anchors_m, float), np.asarray(ranges_m, float)
    middle, reach = anchors_m.mean(axis=0), float(np.median(ranges_m))
    axes = np.eye(anchors_m.shape[1])
    found = []
    for step in (*axes, *-axes):
        fit = scipy.optimize.least_squares(
            lambda place: np.linalg.norm(anchors_m - place, axis=1) - ranges_m, middle + 0.7 * reach * step
        )
        found.append(fit.x)
    return found


def largest_meeting(anchors_m, ranges_m, tolerance_m, least_kept):
    """(size, the sets of that size) whose ranges all lie within the tolerance of a least-squares place."""
    anchors_m, ranges_m = np.asarray(anchors_m, float), np.asarray(ranges_m, float)
    for kept in range(len(ranges_m), least_kept - 1, -1):
        sets = []
        for chosen in itertools.combinations(range(len(ranges_m)), kept):
            a, r = anchors_m[list(chosen)], ranges_m[list(chosen)]
            if any(np.abs(np.linalg.norm(a - place, axis=1) - r).max() <= tolerance_m for place in places(a, r)):
                sets.append(chosen)
        if sets:
            return kept, sets
    return 0, []
