"""``sightline targets``: balls, planes and a pose from tables of pixels, and one sentence where there is none."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image

from tests.reference import depth_images

GEOMETRY = (580.0, 319.5, 239.5, 3.3309, 0.00307)
CENTRES_M = np.array([(0.0, 0.1, 1.2), (0.5, 0.2, 1.5), (-0.4, -0.2, 1.8)])


@pytest.fixture
def table(tmp_path):
    def written(surfaces, name="pixels.csv"):
        lines = ["target,col,row,depth_m"]
        for target, surface in surfaces.items():
            pixels = zip(*depth_images.image(surface, GEOMETRY, np.random.default_rng(1)), strict=True)
            lines += [f"{target},{col:.0f},{row:.0f},{depth:.9f}" for col, row, depth in pixels]
        path = tmp_path / name
        path.write_text("\n".join(lines))
        return path

    return written


def test_balls_and_the_pose_that_they_give(table, tmp_path, sightline):
    path = table({f"B{n}": depth_images.ball(centre, 0.1) for n, centre in enumerate(CENTRES_M)})
    placed = tmp_path / "placed.csv"
    # the sensor looks north: right, down, forward are east, -up, north, from 10, 20, 1
    places = [
        f"B{n},{10.0 + right},{20.0 + forward},{1.0 - down}" for n, (right, down, forward) in enumerate(CENTRES_M)
    ]
    placed.write_text("\n".join(["target,east_m,north_m,up_m", *places]))
    told = sightline("targets", "sphere", path, "--placed", placed, "--json").told()
    assert [ball["radius_m"] for ball in told["balls"]] == pytest.approx([0.1] * 3, abs=3e-4)
    assert [ball["centre_m"] for ball in told["balls"]] == [pytest.approx(centre, abs=1e-3) for centre in CENTRES_M]
    assert told["pose"]["position_m"] == pytest.approx([10.0, 20.0, 1.0], abs=5e-3)
    shown = sightline("targets", "sphere", path, "--placed", placed)
    assert (shown.code, "The sensor's pose" in shown.stdout) == (0, True)


def test_a_plane_beside_what_rounding_would_leave(table, sightline):
    normal = np.array([0.5, 0.2, -0.8]) / np.linalg.norm([0.5, 0.2, -0.8])
    path = table({"wall": depth_images.plane(normal, 1.5 * normal[2], 0.2)})
    (plane,) = json.loads(sightline("targets", "plane", path, "--json").stdout)["planes"]
    assert plane["target"] == "wall"
    assert plane["normal"] == pytest.approx(normal, abs=2e-3)
    assert plane["sigma_m"] == pytest.approx(plane["rounding_sigma_m"], rel=0.3)
    sightline("targets", "sphere", path).refused("Target wall: The points lie on a plane")


@pytest.fixture
def pictures(tmp_path):
    """A folder: balls.png in millimetres, numbers.npy of the sensor, labels.png, and wall.png of one plane."""
    depths_mm, numbers = np.zeros((480, 640), np.uint16), np.full((480, 640), 2047, np.uint16)
    labels, wall_mm = np.zeros((480, 640), np.uint8), np.zeros((480, 640), np.uint16)
    offset, step = GEOMETRY[3:]
    for n, centre in enumerate(CENTRES_M, start=1):
        cols, rows, depths_m = depth_images.image(depth_images.ball(centre, 0.1), GEOMETRY, np.random.default_rng(n))
        where = rows.astype(int), cols.astype(int)
        depths_mm[where], labels[where] = np.rint(1e3 * depths_m), n
        numbers[where] = np.rint((offset - 1.0 / depths_m) / step)
    normal = np.array([0.3, 0.1, -0.95]) / np.linalg.norm([0.3, 0.1, -0.95])
    cols, rows, depths_m = depth_images.image(depth_images.plane(normal, normal[2] * 2.0, 5.0), GEOMETRY)
    wall_mm[rows.astype(int), cols.astype(int)] = np.rint(1e3 * depths_m)
    for name, values in (("balls", depths_mm), ("labels", labels), ("wall", wall_mm)):
        Image.fromarray(values).save(tmp_path / f"{name}.png")
    np.save(tmp_path / "numbers.npy", numbers)
    np.save(tmp_path / "metres.npy", depths_mm / 1e3)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("balls.png", ()),
        ("balls.png", ("--unit", "0.001")),
        ("numbers.npy", ("--unit", "number")),
        ("metres.npy", ()),
    ],
)
def test_a_depth_image_and_its_labels_tell_the_same_balls(pictures, sightline, name, more):
    told = sightline("targets", "sphere", pictures / name, "--labels", pictures / "labels.png", *more, "--json").told()
    assert [ball["target"] for ball in told["balls"]] == ["1", "2", "3"]
    assert [ball["radius_m"] for ball in told["balls"]] == pytest.approx([0.1] * 3, abs=3e-4)
    assert [ball["centre_m"] for ball in told["balls"]] == [pytest.approx(centre, abs=1e-3) for centre in CENTRES_M]


def test_a_depth_image_of_one_plane_is_a_plane_and_no_ball(pictures, sightline):
    (plane,) = sightline("targets", "plane", pictures / "wall.png", "--json").told()["planes"]
    assert plane["normal"] == pytest.approx(np.array([0.3, 0.1, -0.95]) / np.linalg.norm([0.3, 0.1, -0.95]), abs=2e-3)
    assert plane["points"] == 640 * 480
    sightline("targets", "sphere", pictures / "wall.png").refused("Target 1: The points lie on a plane to")


def test_images_that_hold_no_targets_are_told_in_a_sentence(pictures, sightline):
    Image.fromarray(np.zeros((480, 640), np.uint16)).save(pictures / "empty.png")
    Image.fromarray(np.zeros((480, 640, 3), np.uint8)).save(pictures / "colour.png")
    Image.fromarray(np.ones((100, 640), np.uint8)).save(pictures / "small.png")
    (pictures / "cut.png").write_bytes((pictures / "wall.png").read_bytes()[:3000])
    (pictures / "text.npy").write_text("hello")
    np.save(pictures / "far.npy", np.full((480, 640), 1e300))
    (pictures / "metres.csv").write_text("col,row,depth_m\n" + "\n".join(f"{n},{n},2000" for n in range(20)))
    balls = pictures / "balls.png"
    for sentence, *words in (
        ("No pixel of empty.png has a depth.", pictures / "empty.png"),
        ("colour.png must hold one number a pixel", pictures / "colour.png"),
        ("cut.png cannot be read", pictures / "cut.png"),
        ("text.npy is no image that can be read", pictures / "text.npy"),
        ("gone.png cannot be read: No such file", pictures / "gone.png"),
        ("are they millimetres?", pictures / "wall.png", "--unit", "m"),
        ("are they millimetres?", pictures / "metres.csv"),
        ("are they millimetres?", pictures / "far.npy"),
        ("--unit takes m, mm, number, or metres", balls, "--unit", "foot"),
        ("go with a depth image", pictures / "metres.csv", "--unit", "mm"),
        ("a whole number for each of the 480 x 640 pixels", balls, "--labels", pictures / "small.png"),
        ("empty.png marks no pixel", balls, "--labels", pictures / "empty.png"),
    ):
        sightline("targets", "plane", *words).refused(sentence)


def test_what_is_not_used_of_tables_is_told(table, tmp_path, sightline):
    path = table({f"B{n}": depth_images.ball(centre, 0.1) for n, centre in enumerate(CENTRES_M)})
    lines = path.read_text().splitlines()
    path.write_text("\n".join([f"{lines[0]},infrared", *(f"{line},7" for line in lines[1:])]))
    placed = tmp_path / "placed.csv"
    rows = [f"B{n},{east},{north},{-down}" for n, (east, down, north) in enumerate(CENTRES_M)]
    placed.write_text("\n".join(["target,east_m,north_m,up_m", *rows, "B9,1,2,3"]))
    told = sightline("targets", "sphere", path, "--placed", placed, "--json").told()
    assert told["warnings"] == [
        "Columns of pixels.csv that are not used: infrared.",
        "placed.csv places B9, of which there is no pixel.",
    ]
    assert "Columns of pixels.csv" in sightline("targets", "plane", path).stdout
    placed.write_text("\n".join(["target,east_m,north_m,up_m", *rows, rows[1]]))
    sightline("targets", "sphere", path, "--placed", placed).refused("placed.csv places B1 more than once.")


def test_what_gives_no_target_is_told_in_a_sentence(table, tmp_path, sightline):
    few = tmp_path / "few.csv"
    few.write_text("col,row,depth_m\n1,2,1.5\n")
    sightline("targets", "sphere", few).refused("12 points at least, not 1")
    sightline("targets", "plane", few).refused("four points at least, not 1")
    few.write_text("col,row\n1,2\n")
    sightline("targets", "plane", few).refused("few.csv has no column depth_m")
    few.write_text("col,row,depth_m\n1,2,far\n")
    sightline("targets", "plane", few).refused("few.csv, line 2: could not convert")
    few.write_text("col,row,depth_m\n")
    sightline("targets", "plane", few).refused("no row below its header")
    few.write_bytes(b"\xff\xfe\x00col")
    sightline("targets", "plane", few).refused("few.csv is no table of text")
    sightline("targets", "plane", tmp_path / "gone.csv").refused("cannot be read: No such file")
    few.write_text("col,row,depth_m\n1,2,1.5\n")
    sightline("targets", "plane", few, "--centre", "5").refused("--centre takes a column and a row")
    path = table({"A": depth_images.ball((0.0, 0.0, 1.0), 0.1)})
    placed = tmp_path / "placed.csv"
    placed.write_text("target,east_m,north_m,up_m\nB,1,2,3\n")
    sightline("targets", "sphere", path, "--placed", placed).refused("placed.csv does not place A.")
