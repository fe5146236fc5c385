"""What can go wrong with the ground.

TerrainError
├── ElevationGridError      the numbers given do not make a grid
├── DemReadError            a file could not be read as a DEM
│   ├── DemFormatError      not a raster, damaged, or a format that is not allowed
│   ├── DemTooLargeError    more cells than the limit; carries cells and limit
│   └── DemUnsupportedError a raster, but rotated, empty, all void, without usable units ...
├── FrameError              a position or CRS that cannot be expressed in the grid's frame
├── VerticalDatumError      a height that cannot be brought to another vertical datum
└── SampleError             an unknown or damaged bundled DEM
"""

__all__ = [
    "DemFormatError",
    "DemReadError",
    "DemTooLargeError",
    "DemUnsupportedError",
    "ElevationGridError",
    "FrameError",
    "SampleError",
    "TerrainError",
    "VerticalDatumError",
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


class FrameError(TerrainError):
    """A position or CRS cannot be expressed in the grid's frame."""


class VerticalDatumError(TerrainError):
    """A height cannot be brought to another vertical datum: one is unknown, or its geoid model is not there."""


class SampleError(TerrainError):
    """A bundled DEM is unknown or damaged."""
