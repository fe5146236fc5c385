"""What can go wrong with the ground.

TerrainError
├── ElevationGridError      the numbers given do not make a grid
├── DemReadError            a file could not be read as a DEM
│   ├── DemFormatError      not a raster, damaged, or a format that is not allowed
│   ├── DemTooLargeError    more cells than the limit; carries cells and limit
│   ├── DemUnsupportedError a raster, but rotated, empty, all void, without usable units ...
│   ├── NoGroundError       no tile of the ground library lies in the area
│   ├── GroundChangedError  a tile is not what it was when it was indexed
│   └── GroundSourceError   a remote source did not give what it should
├── FrameError              a position or CRS that cannot be expressed in the grid's frame
├── AreaError               an area that is empty, no polygon, or beside the DEM
└── SampleError             an unknown or damaged bundled DEM
"""

__all__ = [
    "AreaError",
    "DemFormatError",
    "DemReadError",
    "DemTooLargeError",
    "DemUnsupportedError",
    "ElevationGridError",
    "FrameError",
    "GroundChangedError",
    "GroundSourceError",
    "NoGroundError",
    "SampleError",
    "TerrainError",
]


class TerrainError(Exception):
    """Base of everything that terrain raises on purpose."""


class ElevationGridError(TerrainError):
    """The heights, cell sizes or origin do not make a grid."""


class DemReadError(TerrainError):
    """A file could not be read as a DEM."""


class DemFormatError(DemReadError):
    """The file is not a raster, is damaged, or has a format that is not allowed."""


class DemTooLargeError(DemReadError):
    """The raster has more cells than the limit; carries ``cells`` and ``limit_cells``."""

    def __init__(self, message: str, *, cells: int, limit_cells: int) -> None:
        super().__init__(message)
        self.cells = cells
        self.limit_cells = limit_cells


class DemUnsupportedError(DemReadError):
    """The file is a raster, but not one that can serve as a DEM."""


class NoGroundError(DemReadError):
    """No tile of the ground library lies in the area that was asked for."""


class GroundChangedError(DemReadError):
    """A tile of the ground library is gone, or is not what it was when it was indexed."""


class GroundSourceError(DemReadError):
    """A remote source did not give what it should: nothing, half a file, a web page, a raster of another place."""


class FrameError(TerrainError):
    """A position or CRS cannot be expressed in the grid's frame."""


class AreaError(TerrainError):
    """An area is empty, is no polygon, or lies beside the DEM."""


class SampleError(TerrainError):
    """A bundled DEM is unknown or damaged."""
