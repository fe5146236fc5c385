"""The air's delay: Saastamoinen towards the zenith, Niell's mapping below it."""

import math

import numpy as np
import pytest

from navigation import MeasurementError, Troposphere, niell_mapping, troposphere_delay_m, zenith_delays

AIR = Troposphere(math.radians(45.0))


def test_at_the_zenith_both_factors_are_one():
    assert niell_mapping(AIR, math.pi / 2.0, 800.0) == (pytest.approx(1.0), pytest.approx(1.0))


def test_at_five_degrees_they_are_those_of_the_published_tables():
    # Niell's coefficients at 45 degrees on day 28, put into Marini's fraction by hand
    sine = math.sin(math.radians(5.0))

    def fraction(a, b, c):
        return (1 + a / (1 + b / (1 + c))) / (sine + a / (sine + b / (sine + c)))

    dry = fraction(1.2465397e-3 - 2.6523662e-5, 2.9288445e-3 - 3.0160779e-5, 63.721774e-3 - 4.3497037e-5)
    wet = fraction(5.8118019e-4, 1.4572752e-3, 4.3908931e-2)
    found = niell_mapping(AIR, math.radians(5.0), 0.0)
    assert found == (pytest.approx(dry, abs=1e-9), pytest.approx(wet, abs=1e-9))
    assert dry == pytest.approx(10.15, abs=0.05)


def test_south_of_the_equator_winter_is_half_a_year_later():
    north = niell_mapping(Troposphere(math.radians(50.0), 28.0), 0.2, 0.0)[0]
    south = niell_mapping(Troposphere(math.radians(-50.0), 28.0 + 365.25 / 2.0), 0.2, 0.0)[0]
    assert north == pytest.approx(south)
    assert north != niell_mapping(Troposphere(math.radians(-50.0), 28.0), 0.2, 0.0)[0]


def test_the_zenith_delay_at_sea_level_is_two_metres_and_a_third_and_less_higher_up():
    dry, wet = zenith_delays(Troposphere(math.radians(45.0)), [0.0, 2000.0])
    assert dry[0] == pytest.approx(0.0022768 * 1013.25, abs=1e-4)
    assert dry[1] / dry[0] == pytest.approx(795.0 / 1013.25, abs=1e-3)
    assert 0.05 < wet[0] < 0.15
    assert wet[1] < wet[0]


def test_lower_satellites_come_later():
    delay_m = troposphere_delay_m(AIR, np.radians([5.0, 15.0, 40.0, 90.0]), 500.0)
    assert (np.diff(delay_m) < 0.0).all()
    assert delay_m[0] == pytest.approx(22.5, abs=1.5)


@pytest.mark.parametrize(
    ("ask", "sentence"),
    [
        (lambda: niell_mapping(AIR, 0.0, 0.0), "3 degrees"),
        (lambda: niell_mapping(AIR, math.nan, 0.0), "3 degrees"),
        (lambda: Troposphere(2.0), "poles"),
        (lambda: Troposphere(0.5, 400.0), "day_of_year"),
        (lambda: Troposphere(0.5, 4.0, 1.5), "humidity"),
    ],
)
def test_what_is_no_sky_is_refused(ask, sentence):
    with pytest.raises(MeasurementError, match=sentence):
        ask()
