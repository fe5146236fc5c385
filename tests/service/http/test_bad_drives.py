"""Drives that are refused over HTTP: each in one sentence, at once, before a job exists."""

from __future__ import annotations

from typing import Any

import pytest

from tests.service.http.test_bad_requests import assert_problem
from tests.service.running import Server
from tests.service.satellite_drives import ZERO_GPS_S, drive_by_satellites
from tests.service.small_drives import drive_request

PLAIN, HEARD = drive_request(), drive_by_satellites(ZERO_GPS_S)
READINGS, SATELLITES = PLAIN["readings"], HEARD["satellites"]


def readings(**changes: Any) -> dict[str, Any]:
    return {**PLAIN, "readings": {**READINGS, **changes}}


def heard(**changes: Any) -> dict[str, Any]:
    return {**HEARD, "satellites": {**SATELLITES, **changes}}


def settings(**changes: Any) -> dict[str, Any]:
    return {**PLAIN, "settings": {**PLAIN["settings"], **changes}}


BAD: dict[str, tuple[dict[str, Any], str, str]] = {
    "forces in g": (
        readings(forces=[[x, y, z / 9.8] for x, y, z in READINGS["forces"]]), "measurement", "say force_unit='g'",
    ),
    "turn rates in degrees": (readings(rates=[[0.0, 0.0, 40.0]] * 401), "measurement", "in degrees, it seems"),
    "axes that gravity contradicts": (settings(axes="frd"), "measurement", "axes='flu' would fit"),
    "axes that are none": (settings(axes="forward"), "measurement", "axes are three letters for x, y, z"),
    "a left-handed unit": (settings(axes="fru"), "measurement", "right-handed"),
    "times that go backwards": (
        readings(times_s=[*READINGS["times_s"][:-1], 3.0]), "time-order", "goes backwards",
    ),
    "one instant": (readings(times_s=[1.0] * 401), "measurement", "two instants at least"),
    "a sigma of zero": (settings(fix_sigma_m=[1.0, 0.0, 1.0]), "validation", "fix_sigma_m"),
    "nothing that corrects": ({**PLAIN, "fixes": [], "ranges": []}, "validation", "lose their way within minutes"),
    "observations that are cut short": (
        heard(observations="\n".join(SATELLITES["observations"].splitlines()[:-2])), "almanac-file", "it is truncated",
    ),
    "a table for observations": (heard(observations="time,x\n1,2\n"), "almanac-file", "no RINEX observation file"),
    "orbits that are cut short": (heard(orbits=[SATELLITES["orbits"][0][:-200]]), "almanac-file", "its last record"),
    "no orbits": (heard(orbits=[]), "validation", "orbits"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD)
def test_a_drive_is_refused_at_once_with(server: Server, ground: dict[str, Any], what: str) -> None:
    request, kind, word = BAD[what]
    answer = server.client.post("/navigations", json={"dem_id": ground["id"], **request})
    assert_problem(answer, 422, kind, word)


def test_orbits_of_another_day_fail_in_a_sentence(server: Server, ground: dict[str, Any]) -> None:
    other = SATELLITES["observations"].replace(" 15 12 31 ", " 16  1  9 ")
    posted = server.client.post("/navigations", json={"dem_id": ground["id"], **heard(observations=other)})
    assert posted.status_code == 202, posted.text
    job = server.until_over(posted.headers["Location"])
    assert job["status"] == "failed"
    assert job["problem"]["type"] == "/problems/gnss-input"
    assert "is of another time than the observation file" in job["problem"]["detail"]
