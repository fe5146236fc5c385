"""``sightline log`` and ``--map``: what is in a log, and how it would be taken, in words, as JSON and as a mapping."""

from __future__ import annotations

import json

import pytest

from tests.service.logs.drive import ANCHORS, RANGES, SECONDS
from tests.service.logs.recorded import RECORDED, ulog


def test_messages_that_nobody_knows_are_shown_and_read_by_a_mapping(tmp_path, sightline):
    messages = [{"timestamp": 10**6 * (s + 5), "peer_no": a, "ticks": 1000.0 * r} for s, a, r in RANGES]
    path = ulog(tmp_path / "own", {"lab_radio": ("uint64_t timestamp;uint8_t peer_no;float ticks;", messages)})
    refused = sightline("detect", path, "--anchor", "1,0,0,120msl")
    refused.refused("no messages are known to be ranges; it has lab_radio")
    shown = sightline("log", path)
    assert shown.code == 0
    assert "peer_no" in shown.stdout
    mapping = {
        "ids": {str(a): f"D{a}" for a in ANCHORS},
        "streams": [
            {
                "stream": "lab_radio",
                "role": "ranges",
                "fields": {"anchor_id": "peer_no", "range_m": "ticks"},
                "units": {"range_m": "mm"},
            }
        ],
    }
    (tmp_path / "map.json").write_text(json.dumps(mapping))
    texts = [word for a, (e, n, u) in ANCHORS.items() for word in ("--anchor", f"D{a},{e},{n},{u}msl")]
    ended = sightline("detect", path, *texts, "--map", tmp_path / "map.json", "--json")
    assert ended.code == 0, ended.stderr
    assert json.loads(ended.stdout)["classifications"] == {"none": SECONDS}


BAD_MAPS = {
    "stream 'nowhere'": {"streams": [{"stream": "nowhere", "role": "ranges", "fields": {"range_m": "r"}}]},
    "'metres' is no field of ranges": {"streams": [{"stream": "a", "role": "ranges", "fields": {"metres": "r"}}]},
    "'mile' is no unit": {
        "streams": [{"stream": "a", "role": "ranges", "fields": {"range_m": "r"}, "units": {"range_m": "mile"}}]
    },
    "time_unit: Input should be 's', 'ms', 'us' or 'ns'": {"time_unit": "h"},
    "colums: this field is not known here": {"colums": {}},
}


@pytest.mark.parametrize("sentence", BAD_MAPS)
def test_a_mapping_that_is_none_is_told_in_a_sentence(tmp_path, sightline, sentence):
    path = RECORDED["PX4 ULog, sensor_uwb"](tmp_path / "log")
    (tmp_path / "map.json").write_text(json.dumps(BAD_MAPS[sentence]))
    sightline("detect", path, "--anchor", "1,0,0,120msl", "--map", tmp_path / "map.json").refused(sentence)


def test_an_inertial_units_and_a_receivers_messages_are_shown_as_navigate_takes_them(tmp_path, sightline):
    forms = {
        "sensor_combined": "uint64_t timestamp;float[3] gyro_rad;float[3] accelerometer_m_s2;",
        "vehicle_gps_position": "uint64_t timestamp;int32_t lat;int32_t lon;int32_t alt;",
    }
    still = {"gyro_rad[0]": 0.0, "gyro_rad[1]": 0.0, "gyro_rad[2]": 0.0}
    force = {"accelerometer_m_s2[0]": 0.0, "accelerometer_m_s2[1]": 0.0, "accelerometer_m_s2[2]": -9.8}
    readings = [{"timestamp": 10**4 * (n + 500), **still, **force} for n in range(200)]
    fixes = [{"timestamp": 10**6 * (s + 5), "lat": 343000000, "lon": -1181000000, "alt": 500000} for s in range(2)]
    made = {"sensor_combined": readings, "vehicle_gps_position": fixes}
    path = ulog(tmp_path / "log", {name: (form, made[name]) for name, form in forms.items()})
    told = json.loads(sightline("log", path, "--json").stdout)
    assert told["problem"] is not None  # for detect
    assert (told["drive"]["readings"], told["drive"]["fixes"], told["drive"]["axes"]) == (200, 2, "frd")
    taken = {one["stream"]: one["taken_for"] for one in told["streams"]}
    assert taken == {"sensor_combined": "inertial readings", "vehicle_gps_position": "fixes"}
    shown = sightline("log", path)
    assert shown.code == 0, shown.stderr
    assert "200 inertial readings over 2.0 s, 2 fixes" in " ".join(shown.stdout.split())


def test_a_table_of_inertial_readings_is_shown_though_detect_would_refuse_it(tmp_path, sightline):
    rows = [f"{n / 100},0,0,9.8,0,0,0" for n in range(100)]
    table = tmp_path / "imu.csv"
    table.write_text("\n".join(["time_s,acc_x,acc_y,acc_z,gyro_x,gyro_y,gyro_z", *rows]))
    told = json.loads(sightline("log", table, "--json").stdout)
    assert told["drive"]["readings"] == 100
    assert told["problem"]
