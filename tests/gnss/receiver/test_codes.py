"""C/A codes against IS-GPS-200: the first ten chips of every satellite, and the whole code made another way."""

from __future__ import annotations

import numpy as np
import pytest

from gnss import GnssInputError
from gnss.receiver import PRNS, ca_code
from tests.reference import gps_signals


@pytest.mark.parametrize("prn", PRNS)
def test_a_code_begins_with_the_ten_chips_of_the_specification(prn):
    bits = (1 - ca_code(prn)[:10].astype(int)) // 2
    # the first digit is the first chip, the others are three chips each
    assert f"{bits[0]}{int(''.join(map(str, bits[1:])), 2):03o}" == gps_signals.FIRST_TEN[prn - 1]


@pytest.mark.parametrize("prn", PRNS)
def test_a_code_is_that_of_the_second_register_delayed(prn):
    assert np.array_equal(ca_code(prn), gps_signals.code(prn))


def test_codes_correlate_by_the_values_of_gold_codes_alone():
    spectra = np.fft.fft([ca_code(prn) for prn in PRNS], axis=1)
    for row in range(len(PRNS)):
        values = np.rint(np.fft.ifft(spectra[row] * np.conj(spectra), axis=1).real).astype(int)
        assert values[row, 0] == 1023
        values[row, 0] = -1
        assert set(np.unique(values)) <= {-65, -1, 63}


@pytest.mark.parametrize("prn", [0, 33, -1])
def test_a_satellite_outside_of_the_table_is_refused(prn):
    with pytest.raises(GnssInputError, match="PRN of 1 to 32"):
        ca_code(prn)
