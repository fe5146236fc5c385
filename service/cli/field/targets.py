"""``sightline targets``: planes and balls among the pixels of depth images, and the sensor's pose from them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter
from rich.table import Table

from service.errors import RequestError
from service.files.written import written_number

from ..asking.options import GROUP, option
from ..output import facts_table, print_json, print_tables, print_warnings

if TYPE_CHECKING:
    from navigation.targets import DepthSensor, SphereFit, TargetPose

__all__ = ["targets"]

targets = App(
    name="targets", help="Planes and balls among the pixels of depth images, and the sensor's pose from them."
)
PixelFile = Annotated[
    Path,
    Parameter(
        name="FILE",
        allow_leading_hyphen=False,
        help="CSV of col, row, depth_m, and target where several are; or a depth image (.png, .tif, .npy).",
    ),
]
AsJson = Annotated[bool, option("Print JSON on standard output and nothing else.", name="--json")]


@GROUP
@dataclass(frozen=True, slots=True)
class ImageOptions:
    """What a depth image does not say of itself."""

    labels: Annotated[
        Path | None,
        option("Image of the same size: 0, or the number of the target. (default all pixels are one)", "FILE"),
    ] = None
    unit: Annotated[
        str | None,
        option("Of its values; number = the sensor's. (default mm of whole numbers, else m)", "m|mm|number|METRES"),
    ] = None


@GROUP
@dataclass(frozen=True, slots=True)
class SensorOptions:
    """The sensor; by default a Kinect of the first kind."""

    focal_px: Annotated[float, option("Focal length, pixels.", "PX", "--focal")] = 580.0
    centre_px: Annotated[str, option("Principal point, pixels.", "COL,ROW", "--centre")] = "319.5,239.5"
    offset_per_m: Annotated[float, option("1/z = offset - step·number.", "PER_M", "--offset")] = 3.3309
    step_per_m: Annotated[float, option("The same.", "PER_M", "--step")] = 0.00307
    noise_steps: Annotated[float, option("One sigma of a number before it is rounded.", "STEPS", "--noise")] = 0.2

    def sensor(self) -> DepthSensor:
        """Raises RequestError, MeasurementError."""
        from navigation.targets import DepthSensor

        try:
            col, row = (written_number(word) for word in self.centre_px.split(","))
        except ValueError as fault:
            raise RequestError(
                f"--centre takes a column and a row such as 319.5,239.5, not {self.centre_px!r}."
            ) from fault
        return DepthSensor(self.focal_px, col, row, self.offset_per_m, self.step_per_m, self.noise_steps)


@targets.command
def plane(
    path: PixelFile,
    /,
    *,
    image: ImageOptions = ImageOptions(),
    sensor: SensorOptions = SensorOptions(),
    as_json: AsJson = False,
) -> None:
    """Fit a plane to each target, and tell its residuals beside what rounding alone would leave."""
    from navigation.targets import fit_plane, quantisation_sigma_m
    from service.files.depth_pixels import read_targets

    used = sensor.sensor()
    seen = read_targets(path, used, image.labels, image.unit)
    rows = []
    for name, pixels in seen.pixels.items():
        with _of(name):
            fit = fit_plane(pixels.points_m(used))
        rounding_m = quantisation_sigma_m(used, fit)
        rows.append((name, fit, rounding_m))
    if as_json:
        found = [
            {
                "target": name,
                "normal": fit.normal.tolist(),
                "distance_m": fit.distance_m,
                "sigma_m": fit.sigma_m,
                "largest_m": fit.largest_m,
                "rounding_sigma_m": rounding_m,
                "points": fit.points,
            }
            for name, fit, rounding_m in rows
        ]
        print_json({"planes": found, "frame": "right, down, forward", "warnings": list(seen.warnings)})
        return
    table = Table(title=f"{path.name}: planes, right, down, forward", title_justify="left")
    for column in ("target", "points", "normal", "distance m", "residuals mm", "by rounding mm"):
        table.add_column(column, justify="left" if column == "target" else "right")
    for name, fit, rounding_m in rows:
        normal = ", ".join(f"{part:.4f}" for part in fit.normal)
        sigmas = f"{1e3 * fit.sigma_m:.2f}", f"{1e3 * rounding_m:.2f}"
        table.add_row(name, str(fit.points), normal, f"{fit.distance_m:.4f}", *sigmas)
    print_tables(table)
    print_warnings(list(seen.warnings))


@targets.command
def sphere(
    path: PixelFile,
    /,
    *,
    image: ImageOptions = ImageOptions(),
    sensor: SensorOptions = SensorOptions(),
    blur_px: Annotated[float, option("Blur of a ball's outline; 0 = it says nothing.", "PX", "--blur")] = 0.5,
    margin_px: Annotated[float, option("How far inside of it depths are not used.", "PX", "--margin")] = 1.0,
    fit_levels: Annotated[bool, option("Take the offset from the depths, where it is not known.")] = False,
    placed: Annotated[
        Path | None, option("CSV of target, east_m, north_m, up_m: tells the sensor's pose.", "FILE")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Fit a ball to each target, knowing the sensor's steps and the ball's outline, beside the common fit."""
    import numpy as np

    from navigation.targets import Limb, fit_sphere, fit_sphere_in_image, register_targets
    from service.files.depth_pixels import read_places, read_targets

    used = sensor.sensor()
    seen = read_targets(path, used, image.labels, image.unit)
    warnings = seen.warnings
    if fit_levels:
        used = used.with_levels_of(np.concatenate([pixels.depths_m for pixels in seen.pixels.values()]))
    limb = Limb(blur_px, margin_px)
    fits, common = {}, {}
    for name, pixels in seen.pixels.items():
        with _of(name):
            fits[name] = fit_sphere_in_image(pixels, used, limb)
            common[name] = fit_sphere(pixels.points_m(used))
    pose = None
    if placed is not None:
        places, told = read_places(placed, list(fits))
        warnings = (*warnings, *told)
        pose = register_targets(
            [fits[name].centre_m for name in fits],
            [fits[name].covariance[:3, :3] for name in fits],
            [places[name] for name in fits],
        )
    if as_json:
        print_json(_document(fits, common, pose, warnings))
        return
    table = Table(title=f"{path.name}: balls, right, down, forward", title_justify="left")
    for column in ("target", "points", "centre m", "radius mm", "sigma mm", "least squares' radius mm"):
        table.add_column(column, justify="left" if column == "target" else "right")
    for name, fit in fits.items():
        centre = ", ".join(f"{part:.4f}" for part in fit.centre_m)
        radii = [f"{1e3 * value:.2f}" for value in (fit.radius_m, fit.radius_sigma_m, common[name].radius_m)]
        table.add_row(name, str(fit.points), centre, *radii)
    print_tables(table, *([] if pose is None else [_pose_table(pose)]))
    print_warnings(list(warnings))


def _pose_table(pose: TargetPose) -> Table:
    sigmas_mm = [f"{1e3 * variance**0.5:.1f}" for variance in pose.covariance.diagonal()[:3]]
    place = ", ".join(f"{part:.4f}" for part in pose.position_m)
    forward = ", ".join(f"{part:.4f}" for part in pose.R_sensor_to_targets[:, 2])
    facts = [("east, north, up m", place), ("sigmas mm", ", ".join(sigmas_mm)), ("looks along", forward)]
    return facts_table("The sensor's pose", [*facts, ("misfit (about 1 is right)", f"{pose.misfit:.2f}")])


def _document(
    fits: dict[str, SphereFit], common: dict[str, SphereFit], pose: TargetPose | None, warnings: Sequence[str]
) -> dict[str, object]:
    found = [
        {
            "target": name,
            "centre_m": fit.centre_m.tolist(),
            "radius_m": fit.radius_m,
            "covariance_m2": fit.covariance.tolist(),
            "points": fit.points,
            "least_squares_radius_m": common[name].radius_m,
        }
        for name, fit in fits.items()
    ]
    told: dict[str, object] = {"balls": found, "frame": "right, down, forward", "warnings": list(warnings)}
    if pose is not None:
        told["pose"] = {
            "position_m": pose.position_m.tolist(),
            "R_sensor_to_targets": pose.R_sensor_to_targets.tolist(),
            "covariance": pose.covariance.tolist(),
            "misfit": pose.misfit,
        }
    return told


@contextmanager
def _of(name: str) -> Iterator[None]:
    """What cannot be fitted is told with the target's name."""
    from navigation import MeasurementError

    try:
        yield
    except MeasurementError as error:
        raise RequestError(f"Target {name}: {error}") from error
