"""Loss by diffraction over a smooth round body, Rec. ITU-R P.526 §3.2: antennas in sight of one another, and beyond.

Distances, heights and radii in metres here; the Recommendation's own km and GHz stand inside the formulas.
"""

import math

from compiled.options import scalar_kernel

__all__ = ["spherical_loss"]

# medium dry ground: relative permittivity, conductivity in S/m (Rec. ITU-R P.527)
PERMITTIVITY, CONDUCTIVITY_S_PER_M = 22.0, 0.003
LIGHT_M_PER_S = 299792458.0
LOWEST_M = 0.01  # of an antenna over the ground: on it the formulas end


@scalar_kernel
def _height_gain(y, surface):
    """G(Y) in dB; surface: the normalised admittance K."""
    if y > 2.0:
        gain = 17.6 * math.sqrt(y - 1.1) - 5.0 * math.log10(y - 1.1) - 8.0
    else:
        gain = 20.0 * math.log10(y + 0.1 * y * y * y)
    return max(gain, 2.0 + 20.0 * math.log10(surface))


@scalar_kernel
def _first_term(distance_m, heights_m, radius_m, wavelength_m, vertical):
    """First term of the residue series, dB; negative where it is no loss."""
    f_ghz, radius_km = LIGHT_M_PER_S / wavelength_m / 1e9, radius_m / 1000.0
    of_ground = (18.0 * CONDUCTIVITY_S_PER_M / f_ghz) ** 2
    surface = 0.036 * (radius_km * f_ghz) ** (-1.0 / 3.0) * ((PERMITTIVITY - 1.0) ** 2 + of_ground) ** -0.25
    if vertical:
        surface *= math.sqrt(PERMITTIVITY**2 + of_ground)
    k2 = surface * surface
    beta = (1.0 + 1.6 * k2 + 0.67 * k2 * k2) / (1.0 + 4.5 * k2 + 1.53 * k2 * k2)
    x = 21.88 * beta * (f_ghz / radius_km**2) ** (1.0 / 3.0) * distance_m / 1000.0
    y = 0.9575 * beta * (f_ghz**2 / radius_km) ** (1.0 / 3.0)
    far = x >= 1.6
    along = 11.0 + 10.0 * math.log10(x) - 17.6 * x if far else -20.0 * math.log10(x) - 5.6488 * x**1.425
    near_m, far_m = heights_m
    return -along - _height_gain(beta * y * near_m, surface) - _height_gain(beta * y * far_m, surface)


@scalar_kernel
def spherical_loss(distance_m, heights_m, radius_m, wavelength_m, vertical):
    """Loss over a smooth body, dB >= 0; heights_m: of both antennas above it; radius_m: effective."""
    near_m, far_m = heights_m
    near_m, far_m = max(near_m, LOWEST_M), max(far_m, LOWEST_M)
    horizon_m = math.sqrt(2.0 * radius_m) * (math.sqrt(near_m) + math.sqrt(far_m))
    if distance_m >= horizon_m:
        return max(_first_term(distance_m, (near_m, far_m), radius_m, wavelength_m, vertical), 0.0)
    # least clearance over the bulge, and what would be enough of it
    c = (near_m - far_m) / (near_m + far_m)
    m = distance_m * distance_m / (4.0 * radius_m * (near_m + far_m))
    b = 2.0 * math.sqrt((m + 1.0) / (3.0 * m))
    b *= math.cos(math.pi / 3.0 + math.acos(1.5 * c * math.sqrt(3.0 * m / (m + 1.0) ** 3)) / 3.0)
    d_1 = distance_m / 2.0 * (1.0 + b)
    d_2 = distance_m - d_1
    over_m = (near_m - d_1 * d_1 / (2.0 * radius_m)) * d_2 + (far_m - d_2 * d_2 / (2.0 * radius_m)) * d_1
    over_m /= distance_m
    enough_m = 0.552 * math.sqrt(d_1 * d_2 * wavelength_m / distance_m)
    if over_m > enough_m:
        return 0.0
    smaller_m = 0.5 * (distance_m / (math.sqrt(near_m) + math.sqrt(far_m))) ** 2
    loss_db = _first_term(distance_m, (near_m, far_m), smaller_m, wavelength_m, vertical)
    return max((1.0 - over_m / enough_m) * loss_db, 0.0)
