"""The place of a triangle that is nearest to a point."""

from compiled.options import scalar_kernel

__all__ = ["nearest_on_triangle"]


@scalar_kernel
def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@scalar_kernel
def _less(a, b):
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@scalar_kernel
def _along(a, step, share):
    return a[0] + share * step[0], a[1] + share * step[1], a[2] + share * step[2]


@scalar_kernel
def _on_edge(point, a, b):
    """Nearest place of the edge from a to b."""
    edge = _less(b, a)
    length2 = _dot(edge, edge)
    if length2 == 0.0:
        return a
    return _along(a, edge, min(max(_dot(_less(point, a), edge) / length2, 0.0), 1.0))


@scalar_kernel
def nearest_on_triangle(point, a, b, c):
    """(place, squared distance) of the triangle a, b, c that is nearest to a point; a flat triangle is its edges.

    Within the plane when the point stands over the inside, else on the nearest of three edges.
    """
    ab, ac, ap = _less(b, a), _less(c, a), _less(point, a)
    bb, bc, cc = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac)
    pb, pc = _dot(ap, ab), _dot(ap, ac)
    area2 = bb * cc - bc * bc
    v, w = cc * pb - bc * pc, bb * pc - bc * pb
    if area2 > 1e-14 * bb * cc and v >= 0.0 and w >= 0.0 and v + w <= area2:
        place = _along(_along(a, ab, v / area2), ac, w / area2)
        away = _less(point, place)
        return place, _dot(away, away)
    place = _on_edge(point, a, b)
    away = _less(point, place)
    least2 = _dot(away, away)
    for start, end in ((b, c), (c, a)):
        other = _on_edge(point, start, end)
        away = _less(point, other)
        distance2 = _dot(away, away)
        if distance2 < least2:
            place, least2 = other, distance2
    return place, least2
