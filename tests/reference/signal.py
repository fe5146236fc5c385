"""Slow obvious oracle for the margin of a link: free space, delta-Bullington and Weissberger as they are published.

Imports nothing of ours. Rec. ITU-R P.525 and P.526-15 §3.2 and §4.5 in the Recommendation's own units, over the edges
of the triangulation that the link crosses; the way through canopy by sampling. Bodies are flat: so large a radius that
their bulge is nothing.
"""

import itertools
import math

from tests.reference.canopy import on_triangles, way_through

LIGHT = 299_792_458.0
FLAT_KM = 1e7


def knife_edge_db(v):
    return 6.9 + 20 * math.log10(math.sqrt((v - 0.1) ** 2 + 1) + v - 0.1) if v > -0.78 else 0.0


def profile(heights, cell, start, end):
    """[(metres along, ground)] where the link, ends (row, col, altitude), crosses rows, columns and diagonals."""
    (r0, c0, _), (r1, c1, _) = start, end
    shares = {0.0, 1.0}
    for a, b in ((r0, r1), (c0, c1), (r0 - c0, r1 - c1)):
        for line in range(math.ceil(min(a, b)), math.floor(max(a, b)) + 1):
            if a != b:
                shares.add((line - a) / (b - a))
    reach = math.hypot(r1 - r0, c1 - c0) * cell
    return [
        (t * reach, on_triangles(heights, r0 + t * (r1 - r0), c0 + t * (c1 - c0)))
        for t in sorted(shares)
        if 0 <= t <= 1
    ]


def bullington_db(ground, h_from, h_to, wavelength):
    """ground: [(d, h)] from end to end; edges across the line between the antennas, distances along it."""
    reach = ground[-1][0]
    slant = math.hypot(reach, h_to - h_from)
    across = reach / slant
    above = [(d, (h - h_from - (h_to - h_from) * d / reach)) for d, h in ground if 1e-6 < d < reach - 1e-6]
    if not above:
        return 0.0

    def v(d, over):
        d1 = slant * d / reach
        return over * across * math.sqrt(2 / wavelength * slant / (d1 * (slant - d1)))

    s_from = max(over / d for d, over in above)
    if s_from < 0:
        edge = knife_edge_db(max(v(d, over) for d, over in above))
    else:
        s_to = max(over / (reach - d) for d, over in above)
        d = reach * s_to / (s_from + s_to) if s_from + s_to > 0 else reach / 2
        edge = knife_edge_db(v(d, s_from * d)) if 0 < d < reach else 0.0
    return edge + (1 - math.exp(-edge / 6)) * (10 + 0.02 * slant / 1000)


def first_term_db(d_km, h1, h2, a_km, f_mhz, vertical):
    eps, sigma = 22.0, 0.003
    k = 0.36 * (a_km * f_mhz) ** (-1 / 3) * ((eps - 1) ** 2 + (18000 * sigma / f_mhz) ** 2) ** -0.25
    if vertical:
        k *= math.sqrt(eps**2 + (18000 * sigma / f_mhz) ** 2)
    beta = (1 + 1.6 * k**2 + 0.67 * k**4) / (1 + 4.5 * k**2 + 1.53 * k**4)
    x = 2.188 * beta * f_mhz ** (1 / 3) * a_km ** (-2 / 3) * d_km
    y1, y2 = (9.575e-3 * beta * f_mhz ** (2 / 3) * a_km ** (-1 / 3) * h for h in (h1, h2))
    f_x = 11 + 10 * math.log10(x) - 17.6 * x if x >= 1.6 else -20 * math.log10(x) - 5.6488 * x**1.425

    def gain(y):
        b = beta * y
        g = 17.6 * math.sqrt(b - 1.1) - 5 * math.log10(b - 1.1) - 8 if b > 2 else 20 * math.log10(b + 0.1 * b**3)
        return max(g, 2 + 20 * math.log10(k))

    return -(f_x + gain(y1) + gain(y2))


def smooth_body_db(d_km, h1, h2, a_km, f_mhz, vertical):
    h1, h2 = max(h1, 0.01), max(h2, 0.01)
    if d_km >= math.sqrt(2 * a_km) * (math.sqrt(0.001 * h1) + math.sqrt(0.001 * h2)):
        return max(first_term_db(d_km, h1, h2, a_km, f_mhz, vertical), 0.0)
    c, m = (h1 - h2) / (h1 + h2), 250 * d_km**2 / (a_km * (h1 + h2))
    b = 2 * math.sqrt((m + 1) / (3 * m))
    b *= math.cos(math.pi / 3 + math.acos(3 * c / 2 * math.sqrt(3 * m / (m + 1) ** 3)) / 3)
    d1 = d_km / 2 * (1 + b)
    d2 = d_km - d1
    h = ((h1 - 500 * d1**2 / a_km) * d2 + (h2 - 500 * d2**2 / a_km) * d1) / d_km
    wavelength = LIGHT / (f_mhz * 1e6)
    h_req = 17.456 * math.sqrt(d1 * d2 * wavelength / d_km)
    if h > h_req:
        return 0.0
    a_em = 500 * (d_km / (math.sqrt(h1) + math.sqrt(h2))) ** 2
    loss = first_term_db(d_km, h1, h2, a_em, f_mhz, vertical)
    return max((1 - h / h_req) * loss, 0.0)


def diffraction_db(ground, h_from, h_to, f_hz, vertical=True):
    """Delta-Bullington over a profile on a flat body."""
    reach, wavelength = ground[-1][0], LIGHT / f_hz
    whole = bullington_db(ground, h_from, h_to, wavelength)
    v1 = sum((d - e) * (h + g) for (e, g), (d, h) in itertools.pairwise(ground))
    v2 = sum((d - e) * (h * (2 * d + e) + g * (d + 2 * e)) for (e, g), (d, h) in itertools.pairwise(ground))
    near, far = (2 * v1 * reach - v2) / reach**2, (v2 - v1 * reach) / reach**2
    inner = [(d, h - (h_from * (reach - d) + h_to * d) / reach) for d, h in ground[1:-1]]
    h_obs = max((over for _, over in inner), default=0.0)
    if h_obs > 0:
        a_t, a_r = max(over / d for d, over in inner), max(over / (reach - d) for d, over in inner)
        near, far = near - h_obs * a_t / (a_t + a_r), far - h_obs * a_r / (a_t + a_r)
    h1, h2 = h_from - min(near, ground[0][1]), h_to - min(far, ground[-1][1])
    steps = 200
    bulged = [
        (reach * i / steps, reach**2 * (i / steps) * (1 - i / steps) / (2000 * FLAT_KM)) for i in range(steps + 1)
    ]
    smooth = bullington_db(bulged, h1, h2, wavelength)
    return whole + max(smooth_body_db(reach / 1000, h1, h2, FLAT_KM, f_hz / 1e6, vertical) - smooth, 0.0)


def margin_db(heights, cell, start, end, radio, tops=None, bases=None):
    """Margin in dB; start, end: (row, col, altitude). radio: fields by name; tops, bases: of canopy, Weissberger."""
    ground = profile(heights, cell, start, end)
    if start[2] < ground[0][1] - 1e-6 or end[2] < ground[-1][1] - 1e-6:
        return -math.inf
    metres = math.hypot(ground[-1][0], end[2] - start[2])
    f_ghz = radio["frequency_hz"] / 1e9
    loss = max(92.45 + 20 * math.log10(f_ghz) + 20 * math.log10(metres / 1000), 0.0)
    loss += diffraction_db(ground, start[2], end[2], radio["frequency_hz"])
    if tops is not None:
        way = way_through(heights, tops, bases, cell, start, end, points=4000)
        loss += 1.33 * f_ghz**0.284 * way**0.588 if way > 14 else 0.45 * f_ghz**0.284 * way
    gains = radio["transmit_gain_dbi"] + radio["receive_gain_dbi"] - radio["losses_db"]
    return radio["transmit_power_dbm"] + gains - radio["sensitivity_dbm"] - loss
