"""The ground: one frozen grid type, reading it, frames, sampling, synthetic terrains, the mesh of the same surface."""

from .array_files import write_npz
from .errors import (
    DemFormatError,
    DemReadError,
    DemTooLargeError,
    DemUnsupportedError,
    ElevationGridError,
    FrameError,
    SampleError,
    TerrainError,
)
from .frames import Body, body_of
from .grid import ElevationGrid, Provenance
from .reading import read_dem
from .sampling import height_at

__all__ = [
    "Body",
    "DemFormatError",
    "DemReadError",
    "DemTooLargeError",
    "DemUnsupportedError",
    "ElevationGrid",
    "ElevationGridError",
    "FrameError",
    "Provenance",
    "SampleError",
    "TerrainError",
    "body_of",
    "height_at",
    "read_dem",
    "write_npz",
]
