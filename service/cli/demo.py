"""``sightline demo``: the whole way over HTTP, with a real DEM and four drones."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import httpx

from dem_samples import sample_path
from service.errors import ServiceError
from service.files.layer import replacing
from service.products.visibility.answer import VisibilityMapSummary
from service.products.visibility.product import VISIBILITY_MAP
from service.warm_up import warm_up

from .maps import leaving_nothing_new, output_folder
from .output import print_json, print_tables, print_warnings, progress_bar
from .own_service import running_service
from .visibility import SUMMARY, anchors_table, count_table

__all__ = ["run_demo"]

DEM = "jacksboro.tif"
# Drones over the fronts of the two mountains and the valley between them: from its floor two or three are in sight.
DRONES = (
    ("D1", -84.2392, 36.3300),
    ("D2", -84.1443, 36.3836),
    ("D3", -84.1107, 36.2963),
    ("D4", -84.1970, 36.2605),
)
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


def run_demo(out: Path, as_json: bool) -> None:
    """Start the service, ask it, write its layers into ``out``, print what it found. Raises ServiceError, OSError."""
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
            files = [_download(client, layer, folder) for layer in layers]
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


def _ask(client: httpx.Client, progress: Any) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Upload the DEM and have the map made: its summary and its layers."""
    with sample_path(DEM).open("rb") as file:
        dem = _json(client.post("/dems", files={"file": (DEM, file, "image/tiff")}))
    progress(0.5)
    drones = [
        {"id": name, "lon_deg": lon_deg, "lat_deg": lat_deg, "above_ground_m": DRONE_ABOVE_GROUND_M}
        for name, lon_deg, lat_deg in DRONES
    ]
    asked = {"dem_id": dem["id"], "anchors": drones, "receiver_above_ground_m": RECEIVER_ABOVE_GROUND_M}
    job = _json(client.post("/visibility-maps", json=asked, headers={"Prefer": f"wait={CALCULATION_MAY_TAKE_S:.0f}"}))
    if job["status"] != "succeeded":
        problem = (job.get("problem") or {}).get("detail", f"its status is {job['status']}")
        raise ServiceError(f"The visibility map was not made: {problem}")
    progress(0.7)
    files = VISIBILITY_MAP.layer
    return job["result"], [layer for layer in job["layers"] if not files[layer["name"]].for_screens]


def _download(client: httpx.Client, layer: dict[str, Any], folder: Path) -> Path:
    path = folder / Path(layer["name"]).name
    answer = client.get(layer["href"]).raise_for_status()
    with replacing(path) as unfinished:
        unfinished.write_bytes(answer.content)
    return path


def _json(answer: httpx.Response) -> dict[str, Any]:
    body: dict[str, Any] = answer.json()
    if answer.is_error:
        raise ServiceError(f"The service refused {answer.request.url.path}: {body.get('detail', answer.status_code)}")
    return body
