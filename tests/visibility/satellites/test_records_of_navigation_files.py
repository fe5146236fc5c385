"""Where records of RINEX navigation files end, and what is passed over."""

import pytest

from gnss import GpsTime, parse_rinex_navigation, read_rinex_navigation
from tests.visibility.satellites.constellation import shared_file
from tests.visibility.satellites.navigation_texts import as_rinex_3, head


@pytest.fixture(scope="module")
def navigation_text():
    return shared_file("rtklib_brdc0910.09n").read_text()


def as_rinex_4(text):
    """The records of RINEX 3 as version 4 has them, a line that tells the kind before each."""
    new = []
    for line in text.splitlines():
        if line[:1] in "GR" and line[1:3].isdecimal():
            new.append(f"> EPH {line[:3]} {'LNAV' if line[0] == 'G' else 'FDMA'}")
        new.append(line.replace("     3.03 ", "     4.00 ", 1) if not new else line)
    other = ["> EPH G03 CNV2", "G03 2009 04 01 00 00 00 0.0 0.0 0.0", *["     0.0"] * 9]
    return "\n".join([*new, *other, "> ION G03 LNAV", "    2009 04 01 00 00 00 1.0 2.0 3.0", "     1.0"])


def test_version_4_says_the_same_and_tells_the_messages_that_it_passed_over(navigation_text):
    old = parse_rinex_navigation(head(navigation_text, 5))
    new = parse_rinex_navigation(as_rinex_4(as_rinex_3(head(navigation_text, 5))))
    assert new.sets == old.sets
    assert new.warnings == tuple(
        f"1 records of {whose} were passed over; only GPS is read." for whose in ("system R", "GPS CNV2", "kind ION")
    )


def changed(navigation_text, change):
    """GPS sets and warnings of a file of RINEX 3 whose lines went through a change; line 10 is the one of GLONASS."""
    lines = as_rinex_3(head(navigation_text, 4)).splitlines()
    found = parse_rinex_navigation("\n".join(change(lines)), "x.rnx")
    return [one.id for one in found.sets], found.warnings


def with_line(number, line):
    return lambda lines: [*lines[:number], line, *lines[number:]]


GLONASS_TOLD = "1 records of system R were passed over; only GPS is read."


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(with_line(14, " " * 23 + " 5.587935447693e-09" * 3), id="a fifth line of GLONASS"),
        pytest.param(lambda lines: lines[:12] + lines[13:], id="one line of GLONASS short"),
        pytest.param(with_line(14, "merged by X".ljust(60) + "COMMENT"), id="a comment between records"),
        pytest.param(with_line(5, "merged by X".ljust(60) + "COMMENT"), id="a comment within a record"),
        pytest.param(with_line(10, "    0.000000000000D+00"), id="a ninth line of GPS"),
        pytest.param(lambda lines: [*lines[:14], *lines[:2], *lines[14:]], id="two files joined, headers and all"),
        pytest.param(with_line(14, ""), id="a blank line"),
    ],
)
def test_a_record_ends_where_the_next_begins(navigation_text, change):
    whole = changed(navigation_text, lambda lines: lines)
    assert len(whole[0]) == 4
    assert changed(navigation_text, change) == whole == (whole[0], (GLONASS_TOLD,))


def test_a_short_gps_record_between_others_is_passed_over_and_told(navigation_text):
    whole, _ = changed(navigation_text, lambda lines: lines)
    ids, warnings = changed(navigation_text, lambda lines: lines[:16] + lines[18:])
    assert ids == [whole[0], *whole[2:]]
    assert warnings == (GLONASS_TOLD, "x.rnx: the record at line 15 has 6 of 8 lines. It was passed over.")


def test_a_gps_record_without_its_last_line_lacks_nothing_that_is_needed(navigation_text):
    whole, _ = changed(navigation_text, lambda lines: lines)
    assert changed(navigation_text, lambda lines: lines[:9] + lines[10:]) == (whole, (GLONASS_TOLD,))


def zeroed(lines, first, health):
    """A GPS record's numbers replaced by zeros, week, time of ephemeris and all."""
    zero, blank = " 0.000000000000D+00", " " * 4
    record = [lines[first][:23] + zero * 3, *[blank + zero * 4] * 5, f"{blank}{zero}{health:19d}{zero}{zero}", blank]
    return [*lines[:first], *record, *lines[first + 8 :]]


def test_an_unhealthy_record_of_zeros_is_unhealthy_from_its_epoch_on(navigation_text):
    lines = as_rinex_3(head(navigation_text, 4)).splitlines()
    found = parse_rinex_navigation("\n".join(zeroed(lines, 14, 63)), "x.rnx")
    whole = parse_rinex_navigation("\n".join(lines))
    assert set(found.unhealthy_ids) == {whole.sets[1].id, *whole.unhealthy_ids}
    assert found.sets[1].toe == whole.sets[1].toe
    assert found.warnings == (GLONASS_TOLD,)


def test_a_healthy_record_of_zeros_is_passed_over_and_told(navigation_text):
    whole, _ = changed(navigation_text, lambda lines: lines)
    ids, warnings = changed(navigation_text, lambda lines: zeroed(lines, 14, 0))
    assert ids == [whole[0], *whole[2:]]
    told = "x.rnx: the record at line 15 is marked healthy but has no orbit, only zeros. It was passed over."
    assert warnings == (GLONASS_TOLD, told)


@pytest.mark.parametrize("name", ["comment_between_records", "glonass_304", "glonass_305"])
def test_the_case_of_line_counts_gives_its_six_gps_satellites(name):
    found = read_rinex_navigation(shared_file(f"../../cases/rinex-line-counts/{name}.rnx"))
    assert [one.id for one in found.sets] == ["G19", "G06", "G09", "G17", "G04", "G11"]
    assert found.warnings == (() if name == "comment_between_records" else (GLONASS_TOLD,))


def at_midnight(lines, first, day, week, toe_s):
    """A GPS record moved to midnight of a day of April 2009, with the week and the second that it is to state."""
    lines = list(lines)
    lines[first] = f"{lines[first][:4]}2009 04 {day:02d} 00 00 00{lines[first][23:]}"
    lines[first + 3] = f"    {toe_s:19.12E}{lines[first + 3][23:]}"
    lines[first + 5] = f"{lines[first + 5][:42]}{week:19.12E}{lines[first + 5][61:]}"
    return lines


# 5 April 2009, a Sunday, is the first day of GPS week 1526; the times of ephemeris are as RTKLIB's adjweek has them
@pytest.mark.parametrize(
    ("week", "toe_s", "expected"),
    [
        (1526, 0.0, GpsTime(1526, 0.0)), (1525, 0.0, GpsTime(1526, 0.0)), (1527, 0.0, GpsTime(1526, 0.0)),
        (1525, 597_600.0, GpsTime(1525, 597_600.0)), (1526, 597_600.0, GpsTime(1525, 597_600.0)),
        (502, 597_600.0, GpsTime(1525, 597_600.0)), (1526, 302_400.0, GpsTime(1526, 302_400.0)),
    ],
)  # fmt: skip
def test_a_week_that_was_not_turned_over_is_the_one_next_to_the_records_epoch(navigation_text, week, toe_s, expected):
    lines = at_midnight(as_rinex_3(head(navigation_text, 4)).splitlines(), 14, 5, week, toe_s)
    found = parse_rinex_navigation("\n".join(lines), "x.rnx")
    assert found.sets[1].toe == expected
    assert found.warnings == (GLONASS_TOLD,)


@pytest.mark.parametrize("week", [1524, 1528, 2549])
def test_a_week_far_from_the_records_epoch_is_passed_over_and_told(navigation_text, week):
    whole, _ = changed(navigation_text, lambda lines: lines)
    ids, warnings = changed(navigation_text, lambda lines: at_midnight(lines, 14, 5, week, 0.0))
    assert ids == [whole[0], *whole[2:]]
    told = f"x.rnx: the record at line 15 is marked healthy but of week {week}, far from its epoch. It was passed over."
    assert warnings == (GLONASS_TOLD, told)
