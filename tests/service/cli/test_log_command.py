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
