"""sightline morph over time: frames, availability and an animation of tracks and satellites."""

import json

import numpy as np
import pytest
import rasterio
from PIL import Image

from service.parts.anchors import FramesIn
from tests.service.cli.positioning_words import ANCHORS, PLACES, band
from tests.service.skies import REFERENCE_DATE, TIME, almanac
from tests.service.small_maps import NORTH_M, WEST_M, small_grid
from visibility import FlightLimit, anchor_above_ground
from visibility.air import availability, morphing_frames
from visibility.sight import AnchorTrack

WAY = [(0.0, 100.0, -100.0, 350.0), (60.0, 700.0, -300.0, 400.0)]
HEADER = "id,time_s,east_m,north_m,altitude_m\n"
CEILING = ("--ceiling", "400msl", "--dop-limit", "6")


@pytest.fixture
def track_file(tmp_path):
    def write(text=None, name="tracks.csv"):
        path = tmp_path / name
        lines = (f"T,{time_s},{WEST_M + e},{NORTH_M + n},{h}\n" for time_s, e, n, h in WAY)
        path.write_text(HEADER + "".join(lines) if text is None else text)
        return path

    return write


def test_frames_and_availability_are_what_the_library_answers(sightline, dem_file, tmp_path, track_file):
    out = tmp_path / "out"
    ended = sightline(
        *("morph", dem_file, *ANCHORS[:6], "--track", track_file(), "--frames", "0,60,20", *CEILING),
        *("--available-at", "100agl", "--out", out, "--json"),
    )
    assert ended.code == 0, ended.stderr
    grid = small_grid()
    standing = [anchor_above_ground(grid, name, WEST_M + e, NORTH_M + n, h) for name, (e, n, h) in PLACES.items()][:3]
    places_m = np.array([(WEST_M + e, NORTH_M + n, h) for _, e, n, h in WAY])
    track = AnchorTrack("T", np.array([0.0, 60.0]), places_m)
    frames = list(morphing_frames(grid, [*standing, track], [0.0, 20.0, 40.0, 60.0], FlightLimit(6.0), ceiling_m=400.0))
    with rasterio.open(out / "frames_altitude.tif") as bands:
        assert bands.descriptions == ("0 s", "20 s", "40 s", "60 s")
        for number, frame in enumerate(frames, start=1):
            assert np.array_equal(bands.read(number), frame.map.altitude_m, equal_nan=True)
            assert np.array_equal(band(out / "frames_state.tif", number), frame.map.state)
    assert np.array_equal(band(out / "altitude.tif"), frames[0].map.altitude_m, equal_nan=True)
    expected = availability(frames, above_ground_m=100.0)
    names = ("first_s", "last_s", "longest_from_s", "longest_to_s", "share", "unknown_share")
    for number, name in enumerate(names, start=1):
        assert np.array_equal(band(out / "availability.tif", number), getattr(expected, name), equal_nan=True), name
    assert len(np.unique(expected.share)) > 2, "it should change"
    told = json.loads(ended.stdout)["over_time"]
    assert [frame["time_s"] for frame in told["frames"]] == [0.0, 20.0, 40.0, 60.0]
    assert [frame["surfaces_computed"] for frame in told["frames"]] == [4, 1, 1, 1], "only the track has moved"
    assert told["available_at"] == {"above_ground_m": 100.0}
    known = ~np.isnan(grid.heights_m)
    assert told["share_always_available"] == pytest.approx(np.mean(expected.share[known] == 1.0))
    with Image.open(out / "animation.gif") as animation:
        assert animation.n_frames == 4
        first = np.asarray(animation.convert("RGB"))
        animation.seek(3)
        assert (np.asarray(animation.convert("RGB")) != first).any(axis=-1).mean() > 0.001
    with Image.open(out / "availability.png") as picture:
        assert min(picture.size) > 400


def test_satellites_move_on_with_the_clock(sightline, dem_file, tmp_path, track_file):
    (tmp_path / "sky.al3").write_text(almanac(unhealthy=2))
    ended = sightline(
        *("morph", dem_file, "--almanac", tmp_path / "sky.al3", "--time", TIME, "--reference-date", REFERENCE_DATE),
        *("--kind", "pseudorange", "--ceiling", "300agl", "--frames", "-3600,3600,3600"),
        *("--out", tmp_path / "out", "--json"),
    )
    told = ended.told()
    assert [frame["time"] for frame in told["over_time"]["frames"]] == [
        f"2007-01-27T{hour:02d}:00:00+00:00" for hour in (5, 6, 7)
    ]
    assert all(frame["satellites"] >= 4 for frame in told["over_time"]["frames"])
    assert "Satellites left out as unhealthy: G01, G02." in told["warnings"]
    with rasterio.open(tmp_path / "out" / "frames_altitude.tif") as bands:
        assert bands.descriptions[0] == "2007-01-27 05:00:00 UTC"
    # each frame is the map of its time
    alone = sightline(
        *("morph", dem_file, "--almanac", tmp_path / "sky.al3", "--time", "2007-01-27T07:00:00Z"),
        *("--kind", "pseudorange", "--ceiling", "300agl", "--out", tmp_path / "alone"),
    )
    assert alone.code == 0
    last = band(tmp_path / "out" / "frames_altitude.tif", 3)
    assert np.array_equal(last, band(tmp_path / "alone" / "altitude.tif"), equal_nan=True)


def test_tracks_may_come_with_limits_in_json(sightline, dem_file, tmp_path, track_file):
    points = [
        dict(zip(("time_s", "east_m", "north_m", "altitude_m"), (t, WEST_M + e, NORTH_M + n, h), strict=True))
        for t, e, n, h in WAY
    ]
    near = json.dumps({"tracks": [{"id": "T", "points": points, "max_range_m": 1.0}]})
    shares = []
    for file in (track_file(), track_file(near, "near.json")):
        ended = sightline("morph", dem_file, *ANCHORS[:4], "--track", file, "--frames", "0,60,30", *CEILING, "--json")
        assert ended.code == 0, ended.stderr
        shares.append(json.loads(ended.stdout)["over_time"]["frames"][0]["share_flyable"])
    # two anchors alone fix nothing
    assert (shares[0] > 0.0, shares[1]) == (True, 0.0)


ROW = f"T,0,{WEST_M + 100},{NORTH_M - 100},350\n"
BAD_TIMES = {
    "frames that are none": (None, ["--frames", "0,60"], "--frames '0,60' is not of the form FROM,TO,STEP"),
    "no step": (None, ["--frames", "0,60,0"], "--frames: Input should be greater than 0"),
    "an end before the start": (None, ["--frames", "60,0,1"], "Frames must end after they begin"),
    "too many frames": (None, ["--frames", "0,60,0.001"], "60,001 frames are more than the limit of 500"),
    "frames without end": (None, ["--frames", "0,1e9,1e-300"], "frames are more than the limit of 500"),
    "a time outside the track": (None, ["--frames", "0,90,30"], "Anchor track T runs from 0 s to 60 s"),
    "a track without frames": (None, [], "Anchors on tracks need frames"),
    "a height without frames": (None, ["--available-at", "60agl"], "--available-at needs --frames"),
    "no height": (None, ["--frames", "0,60,30", "--available-at", "60"], "--available-at '60' is not of the form"),
    "a track underground": (HEADER + ROW.replace("350", "-9"), ["--frames", "0,0,1"], "At 0 s: Anchor T"),
    "times that do not ascend": (HEADER + ROW + ROW, ["--frames", "0,0,1"], "its points must ascend in time_s"),
    "no points": (HEADER, ["--frames", "0,0,1"], "holds no tracks"),
    "strange columns": ("id,when\n", ["--frames", "0,0,1"], "unknown column 'when'"),
    "no id": ("time_s\n", ["--frames", "0,0,1"], "no column 'id'"),
    "words for numbers": (HEADER + "T,now,1,2,3\n", ["--frames", "0,0,1"], "line 2: its cells must be numbers"),
    "an id taken twice": (HEADER + ROW.replace("T,", "D1,"), ["--frames", "0,0,1"], "unique; repeated: D1"),
    "never enough anchors": (HEADER + ROW, ["--frames", "0,0,1", "--min-anchors", "9"], "needs at least 9 anchors"),
}  # fmt: skip


@pytest.mark.parametrize("what", BAD_TIMES)
def test_times_that_cannot_be_are_refused_in_one_sentence(sightline, dem_file, tmp_path, track_file, what):
    text, words, sentence = BAD_TIMES[what]
    ended = sightline(
        *("morph", dem_file, *ANCHORS, "--track", track_file(text), *words, *CEILING, "--out", tmp_path / "out")
    )
    assert (ended.code, sentence in ended.stderr, ended.stderr.count("\n")) == (2, True, 1), ended.stderr
    assert not list((tmp_path / "out").glob("*"))


def test_availability_is_told_of_one_height():
    with pytest.raises(ValueError, match="only one of altitude_m and above_ground_m"):
        FramesIn(to_s=1.0, step_s=1.0, altitude_m=1.0, above_ground_m=1.0)
