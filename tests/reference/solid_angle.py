"""Whether a point is inside a closed mesh whose faces are wound alike: they fill the whole sphere around it."""

import numpy as np


def solid_angle(point, corners_m):
    """Sum over triangles (m, 3, 3), after Van Oosterom and Strackee; 4π or -4π inside, 0 outside."""
    total = 0.0
    for triangle in corners_m:
        a, b, c = triangle - np.asarray(point, float)
        la, lb, lc = np.linalg.norm(a), np.linalg.norm(b), np.linalg.norm(c)
        top = a @ np.cross(b, c)
        bottom = la * lb * lc + (a @ b) * lc + (b @ c) * la + (c @ a) * lb
        total += 2.0 * np.arctan2(top, bottom)
    return total


def is_inside(point, corners_m):
    return abs(solid_angle(point, corners_m)) > 2.0 * np.pi
