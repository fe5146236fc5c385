"""Which tiles an area takes, in which order and why, told before any height is read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import pyproj
import shapely

from ..areas import Area, Outline, area_in_degrees, grown_area
from ..errors import NoGroundError
from .layer import Layer, layers_of
from .tile import Tile, coarser_tile

__all__ = ["RULE", "MosaicPlan", "PlannedLayer", "plan_mosaic"]

RULE = "Finest first, by the ground that a cell covers; of equally fine ones the first by name."
# of the longer side of an area
CORNERS = 0.05
# shares of outlines below this are rounding
SLIVER = 1e-9
WORDS = ("north", "north-east", "east", "south-east", "south", "south-west", "west", "north-west")


@dataclass(frozen=True, slots=True)
class PlannedLayer:
    """A layer and its share: of the area it covers ``covers``, and ``adds`` where no finer one does, both 0..1."""

    layer: Layer
    covers: float
    adds: float

    def reason(self) -> str:
        """Why it is taken, and for what."""
        layer = self.layer
        tiles = "1 tile" if len(layer.tiles) == 1 else f"{len(layer.tiles):,} tiles"
        taken = f"gives {100.0 * self.adds:.3g} % of the area" if self.adds > 0.0 else "only fills voids of finer ones"
        return f"{layer.name}: {tiles}, cells of {layer.cell_m:.3g} m, {taken}."


@dataclass(frozen=True, slots=True)
class MosaicPlan:
    """The layers that an area takes, finest first. area: with its margin; None for all of the tiles.

    uncovered: share of the area that lies in no tile, 0..1. levels: which levels of files a resolution meant, told by
    sentence and number of tiles.
    """

    layers: tuple[PlannedLayer, ...]
    area: Outline | None
    uncovered: float
    levels: tuple[tuple[str, int], ...] = ()

    @property
    def tiles(self) -> tuple[Tile, ...]:
        """All tiles that are taken."""
        return tuple(tile for planned in self.layers for tile in planned.layer.tiles)


def plan_mosaic(
    tiles: Sequence[Tile],
    area: Area | None = None,
    *,
    margin_m: float = 0.0,
    resolution_m: float | None = None,
    body: str = "Earth",
) -> MosaicPlan:
    """The tiles that an area takes; without an area all of them.

    margin_m: ground around the area that is wanted too, since it hides. resolution_m: tiles with overviews are taken at
    the coarsest level whose cells are no coarser. body: whose degrees the area is in.
    Raises NoGroundError, which says what is near; FrameError for an area in metres of no CRS.
    """
    ours = [tile for tile in tiles if tile.body == body]
    if not ours:
        raise NoGroundError(f"The ground library holds no tile of {body}.")
    if area is None:
        wanted, shape = None, shapely.union_all([tile.outline for tile in ours])
        taken = list(ours)
    else:
        wanted = grown_area(area, margin_m)
        shape = area_in_degrees(wanted, ours[0].crs)
        taken = [tile for tile in ours if _beside(tile, shape).intersects(_box_around(shape))]
        if not any(_beside(tile, shape).intersects(shape) for tile in taken):
            raise NoGroundError(_what_is_near(ours, shape))
    levels = Counter[str]()
    for number, tile in enumerate(taken):
        taken[number], told = coarser_tile(tile, resolution_m)
        levels.update([told] if told else [])
    layers = [
        layer
        for layer in layers_of(taken, float(shape.centroid.x))
        if any(_beside(tile, shape).intersects(shape) for tile in layer.tiles)
    ]
    planned, left = list[PlannedLayer](), shape
    for layer in layers:
        covered = shapely.union_all([_beside(tile, shape) for tile in layer.tiles])
        adds = shapely.intersection(left, covered)
        planned.append(PlannedLayer(layer, _share(shapely.intersection(shape, covered), shape), _share(adds, shape)))
        left = shapely.difference(left, covered)
    return MosaicPlan(tuple(planned), wanted, _share(left, shape), tuple(levels.items()))


def _box_around(shape: shapely.Polygon) -> shapely.Polygon:
    """What the corners of the grid may reach: it is the box around the area on a map, turned by up to some degrees."""
    west, south, east, north = shape.bounds
    more = CORNERS * max(east - west, north - south)
    return shapely.box(west - more, south - more, east + more, north + more)


def _share(part: shapely.Geometry, whole: shapely.Geometry) -> float:
    share = float(part.area / whole.area)
    return share if share > SLIVER else 0.0


def _beside(tile: Tile, shape: shapely.Geometry) -> shapely.Polygon:
    """The tile's outline, turned round the planet to where the shape is."""
    turns = round((float(shape.centroid.x) - float(tile.outline.centroid.x)) / 360.0)
    return shapely.affinity.translate(tile.outline, 360.0 * turns) if turns else tile.outline


def _what_is_near(tiles: Sequence[Tile], shape: shapely.Polygon) -> str:
    nearest = min(tiles, key=lambda tile: _beside(tile, shape).distance(shape))
    there = shapely.shortest_line(shape, _beside(nearest, shape))
    (from_lon, from_lat), (to_lon, to_lat) = there.coords
    ellipsoid = nearest.crs.ellipsoid
    assert ellipsoid is not None, "reading the tile has measured its cells on it"
    geodesics = pyproj.Geod(a=ellipsoid.semi_major_metre, b=ellipsoid.semi_minor_metre)
    azimuth_deg, _, way_m = geodesics.inv(from_lon, from_lat, to_lon, to_lat)
    return (
        f"No tile of the ground library lies in the area; the nearest is {nearest.name}, {way_m / 1000.0:.3g} km to "
        f"the {WORDS[round(azimuth_deg / 45.0) % 8]}."
    )
