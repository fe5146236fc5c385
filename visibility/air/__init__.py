"""The air over the ground: control volumes, sections, isosurfaces, morphing maps and how they change with time."""

from visibility.air.control_volumes import (
    AltitudeLayers,
    ControlVolume,
    VoxelBlock,
    altitude_layers,
    control_volume,
    volume_blocks,
    volume_slabs,
    whole_volume,
)
from visibility.air.isosurfaces import Isosurface, isosurface
from visibility.air.morphing_maps import ColumnState, MorphingMap, morphing_map
from visibility.air.morphing_times import Availability, MorphingFrame, availability, morphing_frames
from visibility.air.volume_views import (
    HorizontalSection,
    VerticalSection,
    horizontal_section,
    vertical_section,
    volume_dataset,
)

__all__ = [
    "AltitudeLayers",
    "Availability",
    "ColumnState",
    "ControlVolume",
    "HorizontalSection",
    "Isosurface",
    "MorphingFrame",
    "MorphingMap",
    "VerticalSection",
    "VoxelBlock",
    "altitude_layers",
    "availability",
    "control_volume",
    "horizontal_section",
    "isosurface",
    "morphing_frames",
    "morphing_map",
    "vertical_section",
    "volume_blocks",
    "volume_dataset",
    "volume_slabs",
    "whole_volume",
]
