"""Where records of SEM and YUMA files end, and what is passed over."""

import re
from datetime import date

import pytest

from gnss import parse_almanac, read_almanac
from gnss.errors import AlmanacFileError
from tests.visibility.satellites.almanac_texts import JANUARY_2007, SEM, YUMA
from tests.visibility.satellites.constellation import shared_file


@pytest.mark.parametrize("line", range(3, 11))
def test_a_short_sem_record_between_others_ends_where_the_next_begins_and_is_told(line):
    lines = SEM.splitlines()
    almanac = parse_almanac("\n".join(lines[:line] + lines[line + 1 :]), "x.al3", reference=JANUARY_2007)
    assert [entry.id for entry in almanac.entries] == ["G04"]
    [told] = almanac.warnings
    # without the line of its number, the next stands in its place
    assert told == f"x.al3: record 1 (PRN {32 if line == 3 else 1}) has 7 lines in place of 8. It was passed over."


def test_a_short_yuma_record_between_others_is_passed_over_and_told():
    lines = YUMA.splitlines()
    short = "\n".join(lines[:5] + lines[6:])
    almanac = parse_almanac(f"{short}\n\n{YUMA.replace('01', '02')}", "x.alm", JANUARY_2007)
    assert [entry.id for entry in almanac.entries] == ["G02"]
    assert almanac.warnings == (
        "x.alm: the record of PRN 1 lacks Orbital Inclination; a field is missing. It was passed over.",
    )


@pytest.mark.parametrize(
    ("number", "name"),
    [("193", "QZSS"), ("201", "QZSS"), ("133", "SBAS"), ("J01", "QZSS"), ("E11", "Galileo"), ("99", None), ("0", None)],
)
def test_yuma_records_of_other_systems_are_passed_over_and_counted(number, name):
    foreign = "\n".join([YUMA.splitlines()[0].replace("01", number), f"ID: {number}", "IODA: what it likes", ""])
    almanac = parse_almanac(f"{foreign}\n{YUMA}\n{foreign}", "mixed.alm", JANUARY_2007)
    assert [entry.id for entry in almanac.entries] == ["G01"]
    name = f"satellites with number {number}" if name is None else name
    assert almanac.warnings == (f"2 records of {name} were passed over; only GPS is read.",)
    with pytest.raises(AlmanacFileError, match=rf"no GPS satellite in it\. 1 records of {name} were passed over"):
        parse_almanac(foreign, "foreign.alm", JANUARY_2007)


@pytest.mark.parametrize(("number", "name"), [(193, "QZSS"), (138, "SBAS"), (99, "satellites with number 99")])
def test_sem_records_of_other_systems_are_passed_over_and_counted(number, name):
    almanac = parse_almanac(SEM.replace("\n1\n32", f"\n{number}\n32"), "mixed.al3", JANUARY_2007)
    assert [entry.id for entry in almanac.entries] == ["G04"]
    assert almanac.warnings == (f"1 records of {name} were passed over; only GPS is read.",)


def zeroed(text, health):
    """The same record with health and nothing but zeros besides."""
    if text is YUMA:
        lines = [re.sub(r":.*", ": 0.0", line) for line in text.splitlines()]
        lines[1], lines[2] = "ID: 1", f"Health: {health}"
        return "\n".join([text.splitlines()[0], *lines[1:], ""])
    lines = text.splitlines()
    return "\n".join([*lines[:6], "0.0 0.0 0.0", "0.0 0.0 0.0", "0.0 0.0 0.0", str(health), *lines[10:], ""])


@pytest.mark.parametrize("text", [SEM, YUMA], ids=["SEM", "YUMA"])
def test_an_unhealthy_record_of_zeros_is_unhealthy_and_no_damage(text):
    whole = "" if text is SEM else f"\n{YUMA.replace('01', '02')}"
    almanac = parse_almanac(zeroed(text, 63) + whole, "x", JANUARY_2007)
    assert "G01" in almanac.unhealthy_ids
    assert almanac.warnings == ()


@pytest.mark.parametrize("text", [SEM, YUMA], ids=["SEM", "YUMA"])
def test_a_healthy_record_of_zeros_is_passed_over_and_told(text):
    whole = "" if text is SEM else f"\n{YUMA.replace('01', '02')}"
    almanac = parse_almanac(zeroed(text, 0) + whole, "x", JANUARY_2007)
    assert "G01" not in [entry.id for entry in almanac.entries]
    [told] = almanac.warnings
    assert re.search(r"PRN 1\)? is marked healthy but has no orbit, only zeros\. It was passed over\.", told)


@pytest.mark.parametrize("text", [SEM, YUMA], ids=["SEM", "YUMA"])
def test_remarks_between_lines_of_an_almanac_change_nothing(text):
    remarked = "# fetched today\n" + "".join(f"{line}\n; seen\n" for line in text.splitlines())
    assert parse_almanac(remarked, "x", JANUARY_2007) == parse_almanac(text, "x", JANUARY_2007)


def test_a_real_almanac_with_foreign_and_broken_records_gives_its_gps_satellites():
    text = shared_file("mmazat_yuma431.txt").read_text()
    alone = read_almanac(shared_file("mmazat_yuma431.txt"), date(2007, 12, 1))
    lines = YUMA.splitlines()
    foreign = "\n".join(lines).replace("01", "193")
    mixed = parse_almanac(f"{foreign}\n\n{lines[0]}\n{lines[1]}\n\n{text}", alone.source, date(2007, 12, 1))
    assert mixed.entries == alone.entries
    assert len(mixed.warnings) == 2


@pytest.mark.parametrize(("file", "satellites"), [("qzss_gps.alm", 8), ("rollover2019.alm", 8)])
def test_the_case_of_yuma_files_of_other_systems_is_read(file, satellites):
    almanac = read_almanac(shared_file(f"../../cases/yuma-other-systems/{file}"), date(2019, 5, 8))
    assert len(almanac.entries) == satellites
    assert {entry.applicable.week for entry in almanac.entries} == {2052}
    assert len(almanac.warnings) == (file == "qzss_gps.alm")
