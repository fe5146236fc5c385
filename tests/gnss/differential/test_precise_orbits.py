"""SP3 as its specification (Hilla, The Extended Standard Product 3 Orbit Format, 2016) has it, and as ESA writes it."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from gnss import AlmanacFileError
from gnss.differential import read_orbits
from tests.gnss.differential import world

ALMANAC = Path(__file__).resolve().parents[4] / "shared" / "data" / "almanac"
GPS_EPOCH = datetime(1980, 1, 6, tzinfo=UTC)
STEP_S = 900


def sp3_text(orbits, satellites, middle_s, version="c"):
    """Columns as the specification has them: kilometres and microseconds, six decimals."""
    first_s = int(middle_s) // STEP_S * STEP_S - 8 * STEP_S
    begin = GPS_EPOCH + timedelta(seconds=first_s)
    week, second = divmod(first_s, 604_800)
    day = 44244 + (begin - GPS_EPOCH).days
    moment = f"{begin:%Y} {begin.month:2d} {begin.day:2d} {begin.hour:2d} {begin.minute:2d} {begin.second:11.8f}"
    lines = [
        f"#{version}P{moment} {17:7d} ORBIT IGS14 FIT  TST",
        f"## {week:4d} {second:15.8f} {STEP_S:14.8f} {day:5d} {0.0:15.13f}",
    ]
    slots = [*satellites, *["  0"] * (85 - len(satellites))]
    for row in range(5):
        count = f"{len(satellites):3d}" if row == 0 else "   "
        lines.append(f"+  {count}   " + "".join(slots[17 * row : 17 * row + 17]))
    lines += ["++       " + "  0" * 17] * 5
    lines += ["%c M  cc GPS ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc"]
    lines += ["%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc"]
    lines += ["%f  1.2500000  1.025000000  0.00000000000  0.000000000000000"]
    lines += ["%f  0.0000000  0.000000000  0.00000000000  0.000000000000000"]
    lines += ["%i    0    0    0    0      0      0      0      0         0"] * 2
    lines += ["/* " + "C" * 57] * 4
    for number in range(17):
        at_s = first_s + STEP_S * number
        at = GPS_EPOCH + timedelta(seconds=at_s)
        lines.append(f"*  {at:%Y} {at.month:2d} {at.day:2d} {at.hour:2d} {at.minute:2d} {at.second:11.8f}")
        for satellite in satellites:
            place_m, clock_s = orbits.state(at_s, 0.0, satellite)
            x, y, z = place_m / 1000.0
            lines.append(f"P{satellite}{x:14.6f}{y:14.6f}{z:14.6f}{clock_s * 1e6:14.6f}")
    return "\n".join([*lines, "EOF", ""])


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """(folder with made.nav, its orbits, satellites that it tells of, the middle of their time)."""
    folder = tmp_path_factory.mktemp("orbits")
    (folder / "made.nav").write_text(world.navigation_text())
    orbits = read_orbits(folder / "made.nav")
    middle_s = (orbits.first_s + orbits.last_s) / 2.0
    names = [f"G{number:02d}" for number in range(1, 33)]
    there = [name for name in names if np.isfinite(orbits.positions_ecef_m(int(middle_s), 0.0, name)).all()]
    return folder, orbits, there, middle_s


@pytest.mark.parametrize("version", "cd")
def test_precise_orbits_are_those_that_were_written(made, version):
    folder, orbits, satellites, middle_s = made
    (folder / "made.sp3").write_text(sp3_text(orbits, satellites, middle_s, version))
    precise = read_orbits(folder / "made.nav", folder / "made.sp3")
    assert precise.precise
    assert len(satellites) > 4
    for satellite in satellites:
        for off_s in (-400, 0, 317):
            found, told = (one.positions_ecef_m(int(middle_s) + off_s, 0.25, satellite) for one in (precise, orbits))
            # ten epochs of a quarter of an hour interpolate to centimetres, and the file rounds to millimetres
            np.testing.assert_allclose(found, told, atol=0.05)


def test_precise_orbits_of_another_day_are_one_sentence(made, tmp_path):
    folder, orbits, satellites, middle_s = made
    text = sp3_text(orbits, satellites, middle_s)
    begin = GPS_EPOCH + timedelta(seconds=int(middle_s) // STEP_S * STEP_S - 8 * STEP_S)
    other = text.replace(
        f"{begin:%Y} {begin.month:2d} {begin.day:2d}", f"{begin.year + 1} {begin.month:2d} {begin.day:2d}"
    )
    (tmp_path / "other.sp3").write_text(other)
    with pytest.raises(AlmanacFileError, match="different days"):
        read_orbits(folder / "made.nav", tmp_path / "other.sp3")


@pytest.mark.skipif(not ALMANAC.is_dir(), reason="needs ../shared/data")
def test_esas_orbits_are_the_broadcast_ones_within_their_errors():
    broadcast = read_orbits(ALMANAC / "rtklib_brdc0910.09n")
    both = read_orbits(ALMANAC / "rtklib_brdc0910.09n", ALMANAC / "rtklib_esa15253.sp3")
    at_s = int((both.first_s + both.last_s) / 2.0)
    off_m = []
    for number in range(1, 33):
        first, second = (one.positions_ecef_m(at_s, 0.0, f"G{number:02d}") for one in (broadcast, both))
        if np.isfinite(first).all() and np.isfinite(second).all():
            off_m.append(float(np.linalg.norm(first - second)))
    assert len(off_m) > 20
    assert np.median(off_m) < 3.0
