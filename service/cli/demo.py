"""``sightline demo``: the whole way over HTTP, with a real DEM and four drones."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from service.errors import ServiceError

from .asking.options import option
from .output import leaving_nothing_new, output_folder, print_json, print_tables, print_warnings, progress_bar
from .visibility import SUMMARY, anchors_table, count_table

if TYPE_CHECKING:
    import httpx
    from pydantic import JsonValue

    from service.http.answers import LayerLink

__all__ = ["DRONES", "RECEIVER_ABOVE_GROUND_M", "demo"]

DEM = "jacksboro.tif"
# Drones over the fronts of the two mountains and the valley between them: from its floor two or three are in sight.
DRONES = (("D1", -84.2392, 36.3300), ("D2", -84.1443, 36.3836), ("D3", -84.1107, 36.2963), ("D4", -84.1970, 36.2605))
DRONE_ABOVE_GROUND_M = 150.0
RECEIVER_ABOVE_GROUND_M = 1.5
CALCULATION_MAY_TAKE_S = 120.0
# One map is all it is asked for, so nothing else is compiled, and no process is started that would stand idle.
SETTINGS = {
    "SIGHTLINE_REHEARSE": "maps",
    "SIGHTLINE_WORKERS": "1",
    "SIGHTLINE_FILE_WORKERS": "1",
    "SIGHTLINE_SPARE_WORKERS": "0",
}


def demo(
    *,
    out: Annotated[Path, option("Folder for the files.", "DIR")] = Path("demo-output"),
    as_json: Annotated[bool, option("Print JSON on standard output and nothing else.", name="--json")] = False,
) -> None:
    """Start the service, send it the bundled DEM and four drones over HTTP, and write what it answers."""
    import httpx

    from service.files.layer import replacing
    from service.products.visibility import VISIBILITY_MAP
    from service.products.visibility.calculate import VisibilityMapSummary
    from service.warm_up import warm_up

    from .own_service import running_service

    names = (SUMMARY, *(layer.name for layer in VISIBILITY_MAP.layers if not layer.for_screens))
    folder = output_folder(out, names)
    with progress_bar("Making the kernels of maps ready, which takes a while the first time"):
        warm_up("maps")  # here and not in the service, so that it starts within its time on a slow machine too
    with (
        tempfile.TemporaryDirectory(prefix="sightline-demo-") as data,
        progress_bar("Starting the service") as progress,
        running_service(Path(data), SETTINGS) as client,
        leaving_nothing_new(folder, names),
    ):
        progress(0.3)
        address = str(client.base_url)
        try:
            result, layers = _ask(client, progress)
            files = [
                _download(client, layer, folder) for layer in layers if not VISIBILITY_MAP.layer[layer.name].for_screens
            ]
        except httpx.HTTPError as error:
            raise ServiceError(f"The service at {address} did not answer as it should: {error}.") from error
        with replacing(folder / SUMMARY) as unfinished:
            unfinished.write_text(json.dumps(result, allow_nan=False, indent=1), encoding="utf-8")
        progress(1.0)
    files = [folder / SUMMARY, *files]
    if as_json:
        print_json({"service": address, "result": result, "files": [str(path) for path in files]})
        return
    answer = VisibilityMapSummary.model_validate(result)
    print_tables(anchors_table(answer), count_table(answer))
    print_warnings(answer.warnings)
    print(f"Calculated over HTTP by {address}, which is stopped again. The map to look at is {folder / 'map.png'}.")
    for path in files:
        print(path)


def _ask(client: httpx.Client, progress: Callable[[float], None]) -> tuple[JsonValue, list[LayerLink]]:
    """Upload the DEM and have the map made: its summary and its layers. Raises ServiceError."""
    from dem_samples import sample_path
    from service.http.answers import MapOut

    with sample_path(DEM).open("rb") as file:
        dem = _json(client.post("/dems", files={"file": (DEM, file, "image/tiff")}))
    progress(0.5)
    drones = [
        {"id": name, "lon_deg": lon_deg, "lat_deg": lat_deg, "above_ground_m": DRONE_ABOVE_GROUND_M}
        for name, lon_deg, lat_deg in DRONES
    ]
    asked = {"dem_id": dem["id"], "anchors": drones, "receiver_above_ground_m": RECEIVER_ABOVE_GROUND_M}
    job = _json(client.post("/visibility-maps", json=asked, headers={"Prefer": f"wait={CALCULATION_MAY_TAKE_S:.0f}"}))
    made = MapOut.model_validate(job)
    if made.status != "succeeded":
        why = f"its status is {made.status}" if made.problem is None else made.problem.detail
        raise ServiceError(f"The visibility map was not made: {why}")
    progress(0.7)
    return job["result"], made.layers


def _download(client: httpx.Client, layer: LayerLink, folder: Path) -> Path:
    from service.files.layer import replacing

    path = folder / Path(layer.name).name
    answer = client.get(layer.href).raise_for_status()
    with replacing(path) as unfinished:
        unfinished.write_bytes(answer.content)
    return path


def _json(answer: httpx.Response) -> dict[str, JsonValue]:
    body: dict[str, JsonValue] = answer.json()
    if answer.is_error:
        raise ServiceError(f"The service refused {answer.request.url.path}: {body.get('detail', answer.status_code)}")
    return body
