"""Diffraction over a profile of ground, Rec. ITU-R P.526 §4.5: Bullington's edge, and what a round body adds to it.

Of a profile only its extremes and two integrals are kept (columns of sums), so that places may come in any number.
"""

import math

from compiled.options import scalar_kernel
from visibility.signal.kernels.spherical import spherical_loss

__all__ = [
    "SUMS",
    "bullington_loss",
    "clear_sums",
    "diffraction_loss",
    "put_ground",
    "put_obstacle",
    "round_body_loss",
]

# of a profile with ground y above the line at the share t of the way: most of y/t, y/(1-t), y/sqrt(t(1-t)) with the
# bulge of the body; most of y, y/t, y/(1-t) without it; integrals of ground and ground·t over t; the last t and ground;
# the t that it begins at, and the ground there
FROM_START, FROM_END, ZONE, HIGHEST, FLAT_FROM_START, FLAT_FROM_END = 0, 1, 2, 3, 4, 5
AREA, MOMENT, LAST_T, LAST_GROUND, FIRST_T, FIRST_GROUND = 6, 7, 8, 9, 10, 11
SUMS = 12

AT_THE_END = 1e-9  # of the way: what is there is under an antenna
SMOOTH_STEPS = 128
ROUNDEST_M = 1e10  # a body with a greater radius is flat


@scalar_kernel
def clear_sums(sums):
    """Begin a profile."""
    sums[:AREA] = -math.inf
    sums[AREA], sums[MOMENT] = 0.0, 0.0
    sums[LAST_T:] = math.nan


@scalar_kernel
def put_obstacle(sums, t, above_m, bulge_m):
    """Add what stands above_m over the line at t, bulge_m of it because the body is round."""
    if not AT_THE_END < t < 1.0 - AT_THE_END:
        return
    back, flat_m = 1.0 - t, above_m - bulge_m
    # divided only where that makes a new extreme, which is seldom
    if above_m > sums[FROM_START] * t:
        sums[FROM_START] = above_m / t
    if above_m > sums[FROM_END] * back:
        sums[FROM_END] = above_m / back
    # only a profile that is clear of the line asks for the zone; what lies deeper than the middle's share of it is no
    # extreme wherever it stands, which saves nearly all of the roots
    if not above_m <= sums[ZONE] / 2.0 and not (sums[FROM_START] >= 0.0 and sums[ZONE] > -math.inf):
        zone = math.sqrt(t * back)
        if above_m > sums[ZONE] * zone:
            sums[ZONE] = above_m / zone
    if flat_m > sums[HIGHEST]:
        sums[HIGHEST] = flat_m
    if flat_m > sums[FLAT_FROM_START] * t:
        sums[FLAT_FROM_START] = flat_m / t
    if flat_m > sums[FLAT_FROM_END] * back:
        sums[FLAT_FROM_END] = flat_m / back


@scalar_kernel
def put_ground(sums, t, ground_m, above_m, bulge_m):
    """Add known ground at t, which is not before the last: its altitude, and the same as ``put_obstacle``."""
    if math.isnan(sums[LAST_T]):
        sums[FIRST_T], sums[FIRST_GROUND] = t, ground_m
    else:
        last_t, last_m = sums[LAST_T], sums[LAST_GROUND]
        sums[AREA] += (t - last_t) * (ground_m + last_m) / 2.0
        sums[MOMENT] += (t - last_t) * (ground_m * (2.0 * t + last_t) + last_m * (t + 2.0 * last_t)) / 6.0
    sums[LAST_T], sums[LAST_GROUND] = t, ground_m
    put_obstacle(sums, t, above_m, bulge_m)


@scalar_kernel
def _knife_edge(v):
    """J(v) in dB, 0 where v <= -0.78."""
    if not v > -0.78:
        return 0.0
    return 6.9 + 20.0 * math.log10(math.hypot(v - 0.1, 1.0) + v - 0.1)


@scalar_kernel
def _bullington(from_start, from_end, zone, distance_m, wavelength_m):
    """Loss over one edge where the horizons of both ends meet; the extremes as in sums, but across the line."""
    scale = math.sqrt(2.0 / (wavelength_m * distance_m))
    if from_start < 0.0:
        edge_db = _knife_edge(zone * scale)
    else:
        t = from_end / (from_start + from_end) if from_start + from_end > 0.0 else 0.5
        edge_db = _knife_edge(from_start * math.sqrt(t / (1.0 - t)) * scale) if t < 1.0 else 0.0
    return edge_db + (1.0 - math.exp(-edge_db / 6.0)) * (10.0 + 0.02 * distance_m / 1000.0)


@scalar_kernel
def _smooth(distance_m, heights_m, radius_m, wavelength_m):
    """The same over a smooth body."""
    near_m, far_m = heights_m
    from_start, from_end, zone = -math.inf, -math.inf, -math.inf
    for i in range(1, SMOOTH_STEPS):
        t = i / SMOOTH_STEPS
        above_m = distance_m * distance_m * t * (1.0 - t) / (2.0 * radius_m)
        above_m -= near_m + t * (far_m - near_m)
        from_start, from_end = max(from_start, above_m / t), max(from_end, above_m / (1.0 - t))
        zone = max(zone, above_m / math.sqrt(t * (1.0 - t)))
    return _bullington(from_start, from_end, zone, distance_m, wavelength_m)


@scalar_kernel
def _over_smooth_ground(sums, ends_m):
    """Heights of both antennas over the straight line that fits the ground best, but for what stands out of it."""
    from_m, to_m = ends_m
    near_m = 2.0 * (2.0 * sums[AREA] - 3.0 * sums[MOMENT])
    far_m = 2.0 * (3.0 * sums[MOMENT] - sums[AREA])
    if sums[HIGHEST] > 0.0:
        share = sums[FLAT_FROM_START] / (sums[FLAT_FROM_START] + sums[FLAT_FROM_END])
        near_m, far_m = near_m - sums[HIGHEST] * share, far_m - sums[HIGHEST] * (1.0 - share)
    return from_m - min(near_m, sums[FIRST_GROUND]), to_m - min(far_m, sums[LAST_GROUND])


@scalar_kernel
def bullington_loss(sums, reach_m, ends_m, wavelength_m):
    """Bullington's loss of a profile, dB; reach_m: horizontal distance; ends_m: altitudes of both ends."""
    if not sums[ZONE] > -math.inf:
        return 0.0
    from_m, to_m = ends_m
    distance_m = math.hypot(reach_m, to_m - from_m)
    across = reach_m / distance_m
    from_start, from_end, zone = sums[FROM_START] * across, sums[FROM_END] * across, sums[ZONE] * across
    return _bullington(from_start, from_end, zone, distance_m, wavelength_m)


@scalar_kernel
def round_body_loss(reach_m, heights_m, radius_m, wavelength_m, vertical):
    """What a smooth round body costs more than Bullington's edge over it tells, dB >= 0."""
    whole_db = spherical_loss(reach_m, heights_m, radius_m, wavelength_m, vertical)
    if whole_db == 0.0:
        return 0.0
    return max(whole_db - _smooth(reach_m, heights_m, radius_m, wavelength_m), 0.0)


@scalar_kernel
def diffraction_loss(sums, reach_m, ends_m, radius_m, wavelength_m, vertical):
    """Loss of a profile by the delta-Bullington method, dB; radius_m: effective; the rest as in ``bullington_loss``.

    What a round body adds is told of profiles that reach from end to end.
    """
    loss_db = bullington_loss(sums, reach_m, ends_m, wavelength_m)
    if reach_m > 0.0 and sums[FIRST_T] <= AT_THE_END and sums[LAST_T] >= 1.0 - AT_THE_END:
        heights_m = _over_smooth_ground(sums, ends_m)
        loss_db += round_body_loss(reach_m, heights_m, min(radius_m, ROUNDEST_M), wavelength_m, vertical)
    return loss_db
