"""``sightline receiver``: what it finds in a recording, and one sentence where there is nothing to find."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.reference import gps_signals


@pytest.fixture
def recording(tmp_path):
    rng, path = np.random.default_rng(5), tmp_path / "drive.bin"
    values = gps_signals.noise(rng, 16_000) + gps_signals.signal(5, np.full(16_000, 321 / 4e6), 4e6, 50.0)
    np.round(30.0 * values.astype(np.complex64).view(np.float32)).clip(-128, 127).astype(np.int8).tofile(path)
    return path


def test_it_tells_satellites_as_a_table_and_as_json(recording, sightline):
    words = ("receiver", "acquire", recording, "--rate", "4e6", "--type", "int8", "--doppler-max", "1000")
    table, told = sightline(*words), sightline(*words, "--prn", "5,6", "--json")
    assert table.code == told.code == 0
    assert "321" in table.stdout
    document = json.loads(told.stdout)
    assert [one["prn"] for one in document["satellites"]] == [5, 6]
    found, other = document["satellites"]
    assert (found["found"], found["doppler_hz"], found["code_start_sample"]) == (True, 0.0, 321)
    assert not other["found"]
    assert other["power_over_noise"] < document["threshold"] < found["power_over_noise"]


REFUSED = [
    (["--rate", "4e6", "--type", "int8", "--prn", "9"], "No satellite of 1 is above the threshold; the highest, PRN 9"),
    (["--rate", "4e6", "--type", "int8", "--ms", "9"], "drive.bin is truncated: from 0 s on it holds 4 ms, 9 ms were"),
    (["--rate", "4e6", "--type", "int8", "--prn", "9,x"], "--prn takes numbers of satellites such as 1,7,12"),
    (["--rate", "4e6", "--type", "int8", "--prn", "0"], "A C/A code belongs to a PRN of 1 to 32, not 0."),
    (["--rate", "1e6", "--type", "int8", "--ms", "1"], "A C/A signal needs 2.03 to 100 million complex samples"),
    (["--rate", "5e6", "--type", "int8", "--ms", "3"], "is above the threshold; the highest"),
    (["--rate", "5e6", "--type", "int8", "--ms", "3"], "Are rate and type right?"),
    (["--rate", "4e6", "--ms", "1"], "are the samples of another type?"),
    (["--rate", "4e6", "--type", "int16", "--ms", "1"], "Are rate and type right?"),
    (["--rate", "4e6", "--type", "int8", "--false-alarm", "2"], "A rate of false alarms lies between 0 and 1."),
    (["--type", "int8"], "Missing option '--rate'"),
]


@pytest.mark.parametrize(("words", "sentence"), REFUSED)
def test_what_cannot_be_searched_is_told_in_a_sentence(words, sentence, recording, sightline):
    sightline("receiver", "acquire", recording, "--doppler-max", "1000", *words).refused(sentence)


def test_a_recording_that_is_clipped_is_refused_and_one_that_ends_within_a_sample_told(recording, tmp_path, sightline):
    whole, words = np.fromfile(recording, np.int8), ("--rate", "4e6", "--type", "int8", "--doppler-max", "1000")
    loud, cut, none = (tmp_path / f"{name}.bin" for name in ("loud", "cut", "none"))
    loud.write_bytes(np.clip(60 * whole.astype(int), -128, 127).astype(np.int8).tobytes())
    sightline("receiver", "acquire", loud, *words).refused("loud.bin is clipped: ", "% of its numbers lie at a limit")
    cut.write_bytes(whole.tobytes() + b"\x01")
    told = sightline("receiver", "acquire", cut, *words, "--json").told()
    assert told["warnings"] == ["cut.bin ends in the middle of a sample; its last bytes are left out."]
    none.write_bytes(b"")
    sightline("receiver", "acquire", none, *words).refused("none.bin is truncated")
    sightline("receiver", "acquire", tmp_path / "gone.bin", *words).refused("cannot be read: No such file")


def test_without_a_subcommand_it_shows_what_there_is(sightline):
    shown = sightline("receiver")
    assert (shown.code, "acquire" in shown.stdout) == (2, True)
