"""Which post of the ground sends an anchor's signal on to a receiver by the shortest way."""

import math

from compiled.options import scalar_kernel

__all__ = ["shortest_reflections"]


@scalar_kernel
def _bends(normal, to_receiver, to_anchor, least_cosine):
    """Whether a surface element mirrors one direction into the other, its normal out by no more than the tolerance.

    The directions are unit vectors (3,) away from the element, which reflects with its front only.
    """
    front_receiver, front_anchor, length2 = 0.0, 0.0, 0.0
    for i in range(3):
        front_receiver += normal[i] * to_receiver[i]
        front_anchor += normal[i] * to_anchor[i]
        both = to_receiver[i] + to_anchor[i]
        length2 += both * both
    if not (front_receiver > 0.0 and front_anchor > 0.0 and length2 > 0.0):
        return False
    return front_receiver + front_anchor >= least_cosine * math.sqrt(length2)


@scalar_kernel
def shortest_reflections(places_m, normals, lit, receiver_m, anchors_m, least_cosine, excess_m, post):
    """Fill excess_m (k,) and post (k,) with the shortest way over one of p posts; NaN and -1 where there is none.

    places_m, normals: (p, 3) posts in sight of the receiver, and unit normals there. lit: (k, p) bool, whether the
    anchor is in sight of the post. receiver_m: (3,); anchors_m: (k, 3). least_cosine: of the angle between a normal
    and the bisector that a mirror would have.
    """
    to_receiver, to_anchor = receiver_m.copy(), receiver_m.copy()
    for a in range(anchors_m.shape[0]):
        excess_m[a], post[a] = math.nan, -1
        straight2 = 0.0
        for i in range(3):
            straight2 += (anchors_m[a, i] - receiver_m[i]) ** 2
        straight = math.sqrt(straight2)
        for p in range(places_m.shape[0]):
            if not lit[a, p]:
                continue
            near2, far2 = 0.0, 0.0
            for i in range(3):
                to_receiver[i] = receiver_m[i] - places_m[p, i]
                to_anchor[i] = anchors_m[a, i] - places_m[p, i]
                near2 += to_receiver[i] * to_receiver[i]
                far2 += to_anchor[i] * to_anchor[i]
            near, far = math.sqrt(near2), math.sqrt(far2)
            if not (near > 0.0 and far > 0.0):
                continue
            excess = near + far - straight
            if excess >= excess_m[a]:  # false while excess_m is NaN
                continue
            for i in range(3):
                to_receiver[i] /= near
                to_anchor[i] /= far
            if _bends(normals[p], to_receiver, to_anchor, least_cosine):
                excess_m[a], post[a] = excess, p
