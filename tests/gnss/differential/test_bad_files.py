"""Files of observations and orbits that are cut short, damaged, or something else: one sentence each."""

import numpy as np
import pytest

from gnss import AlmanacFileError, GnssInputError
from gnss.differential import HorizonMask, parse_observations, read_observations, read_orbits
from tests.gnss.differential import world


@pytest.fixture(scope="module", params=[2.10, 3.02])
def whole(request):
    told = world.heard([world.base_m()] * 3, np.random.default_rng(1))
    return world.observation_text(told, world.base_m(), request.param)


def test_a_file_is_whole_or_refused_wherever_it_is_cut(whole):
    lines, passed = whole.splitlines(), []
    for count in range(1, len(lines)):
        cut = "\n".join(lines[:count]) + "\n"
        try:
            found = parse_observations(cut, "cut.obs")
        except AlmanacFileError:
            continue
        else:
            # cut just between two epochs, which no reader can notice
            assert len(set(found.epoch)) in (1, 2)
            passed.append(count)
    assert len(passed) == 2


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "no RINEX observation file"),
        ("<html>not here</html>", "no RINEX observation file"),
        (world.navigation_text(), "another kind"),
        (world.labelled("1.0                 COMPACT RINEX FORMAT", "CRINEX VERS   / TYPE"), "Hatanaka"),
        (world.labelled(f"{4.0:9.2f}           OBSERVATION DATA", "RINEX VERSION / TYPE"), "versions 2 and 3"),
        (world.labelled(f"{2.1:9.2f}           OBSERVATION DATA", "RINEX VERSION / TYPE"), "END OF HEADER"),
        ("\n".join(world.header(2.1, "OBSERVATION DATA")), "TYPES OF OBSERV"),
        ("\n".join(world.header(3.02, "OBSERVATION DATA")), "no epoch"),
    ],
)
def test_what_is_no_observation_file_is_refused(text, sentence):
    with pytest.raises(AlmanacFileError, match=sentence):
        parse_observations(text)


def test_a_damaged_epoch_is_told_with_its_line(whole):
    lines = whole.splitlines()
    begin = next(n for n, line in enumerate(lines) if line[60:].startswith("END OF HEADER")) + 1
    lines[begin] = "what is this"
    with pytest.raises(AlmanacFileError, match=f"line {begin + 1}"):
        parse_observations("\n".join(lines))


@pytest.mark.parametrize("flag", [0, 4])
@pytest.mark.parametrize("count", [-1, -7])
def test_a_count_below_zero_is_refused_and_no_endless_loop(whole, flag, count):
    lines = whole.splitlines()
    begin = next(n for n, line in enumerate(lines) if line[60:].startswith("END OF HEADER")) + 1
    at = 31 if lines[begin].startswith(">") else 28
    lines[begin] = f"{lines[begin][:at]}{flag}{count:3d}"
    with pytest.raises(AlmanacFileError, match=f"line {begin + 1}: how many satellites must not be below zero"):
        parse_observations("\n".join(lines))


def test_orbits_that_are_none_are_refused(tmp_path):
    for name, text, sentence in (
        ("empty.nav", "", "no RINEX navigation file"),
        ("cut.nav", "\n".join(world.navigation_text().splitlines()[:-3]), "truncated"),
        ("headless.nav", world.labelled(f"{2.1:9.2f}           N", "RINEX VERSION / TYPE"), "END OF HEADER"),
        ("none.nav", "\n".join(world.header(2.1, "N")), "no ephemeris"),
        ("cut.sp3", "#cP2015 12 31\n", "truncated"),
    ):
        (tmp_path / name).write_text(text)
        with pytest.raises(AlmanacFileError, match=sentence):
            read_orbits(tmp_path / name)
    with pytest.raises(AlmanacFileError, match="no navigation or SP3 file"):
        read_orbits(tmp_path / "absent.nav")
    with pytest.raises(AlmanacFileError, match="There is no"):
        read_observations(tmp_path / "absent.obs")


def test_a_shell_in_a_files_name_stays_a_name(tmp_path, whole):
    path = tmp_path / "a; touch broken *.obs"
    path.write_text(whole)
    assert len(read_observations(path)) > 0
    assert not (tmp_path / "broken").exists()


@pytest.mark.parametrize(
    ("azimuth", "elevation"),
    [([], []), ([0.0, 1.0], [0.1]), ([1.0, 0.5], [0.0, 0.0]), ([0.0, 7.0], [0.0, 0.0]), ([0.0], [np.nan])],
)
def test_horizons_that_are_none_are_refused(azimuth, elevation):
    with pytest.raises(GnssInputError):
        HorizonMask(np.array(azimuth), np.array(elevation))
