"""``sightline targets``: balls, planes and a pose from tables of pixels, and one sentence where there is none."""

from __future__ import annotations

import json

import numpy as np
import pytest

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
    sightline("targets", "plane", tmp_path / "gone.csv").refused("cannot be read: No such file")
    sightline("targets", "plane", few, "--centre", "5").refused("--centre takes a column and a row")
    path = table({"A": depth_images.ball((0.0, 0.0, 1.0), 0.1)})
    placed = tmp_path / "placed.csv"
    placed.write_text("target,east_m,north_m,up_m\nB,1,2,3\n")
    sightline("targets", "sphere", path, "--placed", placed).refused("placed.csv does not place A.")
