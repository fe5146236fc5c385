"""Planes and balls in depth images, drawn: ``python -m benchmarks.navigation.target_pictures FOLDER``."""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path

import matplotlib.figure
import numpy as np
from matplotlib.axes import Axes

from navigation.targets import (
    KINECT,
    DepthSensor,
    SphereFit,
    TargetPixels,
    fit_plane,
    fit_sphere,
    fit_sphere_algebraic,
    fit_sphere_in_image,
    quantisation_sigma_m,
)
from tests.reference import depth_images

__all__ = ["draw"]

BLUE, RED, GREEN, RADIUS_M = "#2c5f9e", "#c2452d", "#5d7a3c", 0.152
SLANT = np.array([0.5, 0.2, -0.8]) / np.linalg.norm([0.5, 0.2, -0.8])


def draw(folder: Path) -> list[Path]:
    """The pictures of docs/targets.md as PNG."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {"planes": planes(), "spheres": spheres()}
    for name, figure in drawn.items():
        figure.savefig(folder / f"{name}.png", dpi=100)
    return [folder / f"{name}.png" for name in drawn]


def planes() -> matplotlib.figure.Figure:
    """Residuals of an inclined plane, and their spread by range beside that of rounding (figures 6.5 to 6.7)."""
    figure = matplotlib.figure.Figure(figsize=(12.0, 4.2), layout="constrained")
    panels: list[Axes] = list(figure.subplots(1, 2))
    surface = depth_images.plane(SLANT, SLANT[2] * 2.0, 0.3)
    points_m = TargetPixels(*depth_images.image(surface, _geometry(KINECT))).points_m(KINECT)
    fit = fit_plane(points_m)
    off_mm = 1e3 * (points_m @ fit.normal - fit.distance_m)
    shown = panels[0].scatter(points_m[::7, 0], -points_m[::7, 1], c=off_mm[::7], s=3, cmap="RdBu", vmin=-8, vmax=8)
    panels[0].set(title="a plane 2 m away, inclined by 34°: residuals, mm", xlabel="right, m", ylabel="up, m")
    panels[0].set_aspect("equal")
    figure.colorbar(shown, ax=panels[0])
    ranges_m = np.arange(0.5, 5.01, 0.25)
    sigmas_mm, theory_mm = [], []
    for range_m in ranges_m:
        pixels = TargetPixels(
            *depth_images.image(depth_images.plane(SLANT, SLANT[2] * range_m, 0.3), _geometry(KINECT))
        )
        fit = fit_plane(pixels.points_m(KINECT))
        sigmas_mm.append(1e3 * fit.sigma_m)
        theory_mm.append(1e3 * quantisation_sigma_m(KINECT, fit))
    panels[1].plot(ranges_m, theory_mm, color="black", lw=1.0, label="step·z²/√12 across the plane")
    panels[1].plot(ranges_m, sigmas_mm, "o", color=BLUE, label="residuals")
    panels[1].set(title="residuals by range", xlabel="range, m", ylabel="one sigma, mm")
    panels[1].legend()
    return figure


def spheres() -> matplotlib.figure.Figure:
    """A ball at 3 m with its levels and three fits, and radii by range (figures 6.10, 6.12, 6.14)."""
    figure = matplotlib.figure.Figure(figsize=(12.0, 4.4), layout="constrained")
    panels: list[Axes] = list(figure.subplots(1, 2))
    coarse = dataclasses.replace(KINECT, step_per_m=2.0 * KINECT.step_per_m)
    centre_m = np.array([0.05, -0.03, 3.0])
    taken = _image(centre_m, coarse, 4)
    points_m = taken.points_m(coarse)
    near = np.abs(points_m[:, 1] - centre_m[1]) < 0.006
    panels[0].plot(points_m[near, 0], points_m[near, 2], ".", color="black", ms=3, label="pixels of one row")
    turn = np.linspace(np.pi, 2.0 * np.pi, 200)
    balls = {
        "truth": (centre_m, RADIUS_M, "#999999"),
        "common fit": (*_of(fit_sphere_algebraic(points_m)), RED),
        "steps and outline": (*_of(fit_sphere_in_image(taken, coarse)), BLUE),
    }
    for name, (centre, radius, colour) in balls.items():
        panels[0].plot(centre[0] + radius * np.cos(turn), centre[2] + radius * np.sin(turn), color=colour, label=name)
    panels[0].set(title="a ball of 152 mm, 3 m away, at double the step", xlabel="right, m", ylabel="forward, m")
    panels[0].set_aspect("equal")
    panels[0].legend(fontsize=8)
    ranges_m = np.arange(0.9, 3.01, 0.3)
    for sensor, style in ((KINECT, "-"), (coarse, "--")):
        radii_mm = np.array([_radii_mm(sensor, float(range_m), n) for n, range_m in enumerate(ranges_m)])
        step = "step" if sensor is KINECT else "double step"
        for column, (name, colour) in enumerate((("common", RED), ("least squares", GREEN), ("steps, outline", BLUE))):
            panels[1].plot(ranges_m, radii_mm[:, column], style, color=colour, label=f"{name}, {step}")
    panels[1].axhline(1e3 * RADIUS_M, color="black", lw=0.7, ls=":")
    panels[1].set(title="radii by range, mean of four", xlabel="range, m", ylabel="radius, mm")
    panels[1].legend(fontsize=8)
    return figure


def _radii_mm(sensor: DepthSensor, range_m: float, seed: int) -> list[float]:
    found = []
    for n in range(4):
        taken = _image(np.array([0.06 * n - 0.1, 0.05 - 0.03 * n, range_m]), sensor, 10 * seed + n)
        points_m = taken.points_m(sensor)
        fits = fit_sphere_algebraic(points_m), fit_sphere(points_m), fit_sphere_in_image(taken, sensor)
        found.append([1e3 * fit.radius_m for fit in fits])
    return [float(value) for value in np.mean(found, axis=0)]


def _image(centre_m: np.ndarray, sensor: DepthSensor, seed: int) -> TargetPixels:
    rng = np.random.default_rng(seed)
    return TargetPixels(*depth_images.image(depth_images.ball(centre_m, RADIUS_M), _geometry(sensor), rng))


def _of(fit: SphereFit) -> tuple[np.ndarray, float]:
    return fit.centre_m, fit.radius_m


def _geometry(sensor: DepthSensor) -> tuple[float, float, float, float, float]:
    return sensor.focal_px, sensor.centre_col_px, sensor.centre_row_px, sensor.offset_per_m, sensor.step_per_m


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    for path in draw(parser.parse_args().folder):
        print(path)
