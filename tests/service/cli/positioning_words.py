"""Four drones over the small DEM as words of a command line, for tests of sightline dop and sightline morph."""

import rasterio

from tests.service.small_maps import NORTH_M, WEST_M

PLACES = {
    "D1": (95.0, -305.0, 120.0),
    "D2": (750.0, -90.0, 150.0),
    "D3": (400.0, -30.0, 90.0),
    "D4": (60.0, -80.0, 200.0),
}
ANCHORS = [
    word
    for name, (east_m, north_m, above_m) in PLACES.items()
    for word in ("--anchor", f"{name},{WEST_M + east_m},{NORTH_M + north_m},{above_m}agl")
]


def band(path, number=1):
    with rasterio.open(path) as dataset:
        return dataset.read(number)
