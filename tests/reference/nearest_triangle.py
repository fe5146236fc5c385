"""Distance from a point to triangles, one by one: onto the plane where the foot lies within, else onto three edges."""

import numpy as np


def distance_to_triangle_m(point, corners):
    a, b, c = (np.asarray(corner, float) for corner in corners)
    candidates = [_on_segment(point, a, b), _on_segment(point, b, c), _on_segment(point, c, a)]
    normal = np.cross(b - a, c - a)
    if normal @ normal > 0.0:
        foot = point - normal * ((point - a) @ normal) / (normal @ normal)
        if all(np.cross(q - p, foot - p) @ normal >= 0.0 for p, q in ((a, b), (b, c), (c, a))):
            candidates.append(foot)
    return min(float(np.linalg.norm(point - candidate)) for candidate in candidates)


def _on_segment(point, a, b):
    along = b - a
    share = 0.0 if along @ along == 0.0 else np.clip((point - a) @ along / (along @ along), 0.0, 1.0)
    return a + share * along


def distance_to_surface_m(heights_m, cell_east_m, cell_north_m, origin_m, point):
    """Smallest distance to any triangle of the DEM whose three posts are known."""
    rows, cols = heights_m.shape

    def post(row, col):
        return np.array([origin_m[0] + col * cell_east_m, origin_m[1] - row * cell_north_m, heights_m[row, col]])

    nearest_m = np.inf
    for row in range(rows - 1):
        for col in range(cols - 1):
            for other in ((row + 1, col), (row, col + 1)):
                corners = [post(row, col), post(*other), post(row + 1, col + 1)]
                if np.isfinite([corner[2] for corner in corners]).all():
                    nearest_m = min(nearest_m, distance_to_triangle_m(np.asarray(point, float), corners))
    return nearest_m
