"""SEM and YUMA files, read as GPSTk reads them, and refused when damaged."""

import math
import re
from datetime import UTC, date, datetime

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gnss import GpsTime, almanac_positions_ecef_m, instants, parse_almanac, read_almanac
from gnss.almanac import REFERENCE_INCLINATION_RAD
from gnss.errors import AlmanacError, AlmanacFileError
from tests.visibility.satellites.almanac_texts import JANUARY_2007, SEM, YUMA
from tests.visibility.satellites.constellation import shared_file


def gpstk_blocks(name):
    """What GPSTk prints of each satellite: number, week and second of its orbit epoch, and parameters by name."""
    text = shared_file(name).read_text()
    for block in text.split("ORB/CLK ALMANAC PARAMETERS FOR GPS ")[1:]:
        epoch = re.search(r"Orbit Epoch:.*?(\d+)\s+(\d+)\s+GPS", block)
        values = dict(re.findall(r"^(\w+)\s+(0x[\dA-F]+|[-+.\dE]+)(?:\s|$)", block.split("Value")[1], re.MULTILINE))
        yield int(block.split()[0]), int(epoch[1]), float(epoch[2]), values


@pytest.mark.parametrize(
    ("file", "expected", "satellites"),
    [
        ("gpstk_test_input_sem387.txt", "gpstk_test_output_SEM_T.exp", 30),
        ("gpstk_test_input_yuma377.txt", "gpstk_test_output_Yuma_T.exp", 30),
    ],
)
def test_files_are_read_as_gpstk_reads_them(file, expected, satellites):
    almanac = read_almanac(shared_file(file), date(1987, 5, 1))  # its weeks are left as they stand in the file
    by_prn = {entry.prn: entry for entry in almanac.entries}
    blocks = list(gpstk_blocks(expected))
    assert [number for number, *_ in blocks] == list(by_prn)
    assert len(by_prn) == satellites
    for number, week, second_of_week, values in blocks:
        entry = by_prn[number]
        assert entry.applicable == GpsTime(week, second_of_week)
        ours = {
            "AHalf": entry.sqrt_semi_major_axis_sqrt_m,
            "af1": entry.clock_drift_s_per_s,
            "af0": entry.clock_bias_s,
            "Omega0": entry.node_longitude_rad,
            "e": entry.eccentricity,
            "deltai": entry.inclination_rad - REFERENCE_INCLINATION_RAD,
            "Omega_Dot": entry.node_rate_rad_per_s,
            "w": entry.argument_of_perigee_rad,
            "M0": entry.mean_anomaly_rad,
        }
        for name, value in ours.items():
            # nine digits are printed
            assert value == pytest.approx(float(values[name]), rel=1e-8, abs=1e-11), (number, name)
        assert entry.health == int(values["Health"], 16)


def test_a_file_with_windows_line_ends_is_the_same_file():
    almanac = read_almanac(shared_file("mmazat_yuma431.txt"), date(2007, 12, 1))
    assert len(almanac.entries) == 31
    assert almanac.unhealthy_ids == ("G32",)
    assert almanac.entries[0].applicable.utc() == datetime(2007, 12, 1, 19, 50, 10, tzinfo=UTC)
    assert parse_almanac(YUMA.replace("\n", "\r\n"), reference=JANUARY_2007) == parse_almanac(
        YUMA, reference=JANUARY_2007
    )


def test_the_rollover_is_undone_by_the_reference_date():
    for reference, week in [(date(1987, 6, 1), 387), (JANUARY_2007, 1411), (datetime(2026, 9, 9, tzinfo=UTC), 2435)]:
        almanac = parse_almanac(SEM, reference=reference)
        assert {entry.applicable.week for entry in almanac.entries} == {week}


def test_a_file_that_counts_full_weeks_needs_no_reference():
    assert parse_almanac(SEM.replace(" 387 ", " 2435 ")).entries[0].applicable.week == 2435
    assert parse_almanac(YUMA.replace("377", "1401")).entries[0].applicable.week == 1401


@pytest.mark.parametrize("text", [SEM, YUMA])
def test_a_week_modulo_1024_without_reference_is_refused(text):
    with pytest.raises(AlmanacError, match="counted modulo 1024"):
        parse_almanac(text)


def test_blank_lines_carry_no_meaning_in_sem():
    close = "\n".join(line for line in SEM.splitlines() if line)
    assert parse_almanac(close, reference=JANUARY_2007) == parse_almanac(SEM, reference=JANUARY_2007)


def test_unhealthy_satellites_are_told_apart():
    almanac = parse_almanac(SEM, reference=JANUARY_2007)
    assert [entry.id for entry in almanac.healthy] == ["G01"]
    assert almanac.unhealthy_ids == ("G04",)
    assert (almanac.entries[1].svn, almanac.entries[1].ura, almanac.entries[1].configuration) == (34, 15, 9)


@pytest.mark.parametrize("line", range(len(SEM.splitlines())))
def test_a_sem_file_cut_after_any_line_is_refused_in_one_sentence(line):
    with pytest.raises(AlmanacFileError) as refused:
        parse_almanac("\n".join(SEM.splitlines()[:line]), "x.al3", JANUARY_2007)
    assert str(refused.value).startswith("x.al3")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("line", range(len(YUMA.splitlines())))
def test_a_yuma_file_cut_after_any_line_is_refused_in_one_sentence(line):
    with pytest.raises(AlmanacFileError, match=r"x\.alm"):
        parse_almanac("\n".join(YUMA.splitlines()[:line]), "x.alm", JANUARY_2007)


@pytest.mark.parametrize("line", [number for number, text in enumerate(SEM.splitlines()) if text and number > 11])
def test_a_sem_file_without_one_of_its_last_lines_is_refused(line):
    lines = SEM.splitlines()
    with pytest.raises(AlmanacFileError):
        parse_almanac("\n".join(lines[:line] + lines[line + 1 :]), reference=JANUARY_2007)


@pytest.mark.parametrize("line", range(1, len(YUMA.splitlines())))
def test_a_yuma_file_says_which_field_it_lacks(line):
    lines = YUMA.splitlines()
    name = re.sub(r"\(\w/?\w*\)$", "", lines[line].split(":")[0]).strip().removesuffix("  (m 1/2)")
    with pytest.raises(AlmanacFileError, match=rf"PRN 1 lacks {re.escape(name)}; a field is missing"):
        parse_almanac("\n".join(lines[:line] + lines[line + 1 :]), reference=JANUARY_2007)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("hello\n", "neither a SEM nor a YUMA almanac; it begins with 'hello'"),
        ("30 CURRENT.ALM\n", "second line must hold the week"),
        ("30 CURRENT.ALM\n387\n", "second line must hold the week"),
        (SEM.replace("2 CURRENT", "31 CURRENT"), "declares 31 satellites but holds 2; it is truncated"),
        (SEM.replace("589824", "604800"), "second of the week"),
        (SEM.replace(" 387 ", " 3x7 "), "the week must be a number, not '3x7'"),
        (SEM.replace("6.7005157470703E-03", "nan"), r"record 1 \(PRN 1\): the eccentricity must be a number"),
        (SEM.replace("6.7005157470703E-03", "1.5"), "eccentricity must satisfy"),
        (SEM.replace("5.1536845703125E+03", "12.0"), "semi-major axis must lie in"),
        (SEM.replace("1.4945983886719E-02", "0.9"), "inclination must lie in"),
        (SEM.replace("\n4\n34", "\n1\n34"), "stand once in the almanac .*repeated: G01"),
        (SEM.replace("\n4\n34", "\n4.5\n34"), "PRN number must be a whole number"),
        (SEM.replace("1.4945983886719E-02 ", ""), r"record 1 \(PRN 1\) holds 2 numbers in place of 3"),
        (YUMA + "Weather: fine\n", "a line that no YUMA almanac has: 'Weather: fine'"),
        (YUMA + "week: 377\n", "tells week twice"),
        (YUMA.replace("0.9893061549", "inf"), "Orbital Inclination must be a number"),
        (YUMA.replace("5153.683594", "-5153.683594"), "semi-major axis must lie in"),
        (YUMA.replace("319488.0000", "-1"), "second of the week"),
        (YUMA.replace("319488.0000", "soon"), "Time of Applicability must be a number, not 'soon'"),
        (YUMA + YUMA, "repeated: G01"),
    ],
)
def test_each_fault_of_a_file_gets_its_sentence(text, words):
    with pytest.raises(AlmanacError, match=words):
        parse_almanac(text, "an almanac", JANUARY_2007)


@given(st.sampled_from([SEM, YUMA]), st.data())
@settings(max_examples=300, deadline=None)
def test_damage_of_any_kind_ends_in_one_sentence_or_in_an_orbit(text, data):
    at = data.draw(st.integers(0, len(text) - 1))
    damage = data.draw(
        st.text("0123456789.+-eE²_*:\n \tx", max_size=12) | st.sampled_from(["9" * 5000, "1e300", "nan"])
    )
    length = data.draw(st.integers(0, 30))
    sentence = None
    try:
        almanac = parse_almanac(text[:at] + damage + text[at + length :], "damaged", JANUARY_2007)
    except AlmanacError as error:
        sentence = str(error)
    if sentence is None:
        when = instants(almanac.entries[0].applicable)
        healthy = [entry for entry in almanac.entries if entry.healthy]
        assert not healthy or np.isfinite(almanac_positions_ecef_m(healthy, when, math.inf)).all()
    else:
        assert sentence
        assert "\n" not in sentence


def test_files_that_cannot_be_read_are_named(tmp_path):
    for name, content, words in [
        ("packed.gz", b"\x1f\x8b\x08", "packed.gz is compressed; unpack it first"),
        ("picture.bin", b"12\0\0", "is not a text file"),
        ("long.txt", b"1" * 1_000_001, "longer than 1000000 bytes"),
    ]:
        (tmp_path / name).write_bytes(content)
        with pytest.raises(AlmanacFileError, match=words):
            read_almanac(tmp_path / name, JANUARY_2007)
    with pytest.raises(AlmanacFileError, match="There is no almanac file"):
        read_almanac(tmp_path / "absent.alm", JANUARY_2007)
    with pytest.raises(AlmanacFileError, match="There is no almanac file"):
        read_almanac(tmp_path, JANUARY_2007)
