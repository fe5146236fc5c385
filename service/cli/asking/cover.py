"""What stands on the ground of a command: ``--buildings`` and what goes with it; the ``cover`` of a request."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from service.errors import RequestError

if TYPE_CHECKING:
    from terrain import ElevationGrid

__all__ = ["BARE", "CoverOptions"]

OF_FOOTPRINTS = (".geojson", ".json")


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class CoverOptions:
    """Buildings on the DEM: in every command they hide, and nobody drives or flies through them."""

    buildings: Annotated[
        Path | None,
        Parameter(
            name="--buildings",
            metavar="FILE",
            help="Buildings on the ground: footprints with heights (.geojson), or a mesh in metres (.stl, .obj, .ply, "
            ".glb).",
        ),
    ] = None
    level_m: Annotated[
        float | None,
        Parameter(name="--level-height", metavar="M", help="Of each level of footprints without height, metres."),
    ] = None
    default_height_m: Annotated[
        float | None,
        Parameter(name="--default-height", metavar="M", help="Of footprints that tell neither, metres."),
    ] = None
    building_heights: Annotated[
        Literal["above_ground", "absolute"],
        Parameter(name="--building-heights", help="A mesh's bodies stand on the ground, or it holds altitudes."),
    ] = "above_ground"
    building_origin: Annotated[
        str | None,
        Parameter(name="--building-origin", metavar="EAST,NORTH", help="Where a mesh's own origin lies. (default 0,0)"),
    ] = None

    @property
    def of_mesh(self) -> bool:
        """Whether the file is a mesh."""
        return self.buildings is not None and self.buildings.suffix.lower() not in OF_FOOTPRINTS

    def mesh(self) -> dict[str, object] | None:
        """A mesh as a request has it; None without one. Raises RequestError, MeshError."""
        if self.buildings is None:
            if self.building_origin is not None:
                raise RequestError("--building-origin needs --buildings FILE.")
            return None
        if not self.of_mesh:
            return None
        from visibility.cover.mesh_files import read_mesh_bytes

        from .texts import numbers_of

        origin = numbers_of(self.building_origin or "0,0")
        if origin is None or len(origin) != 2:
            raise RequestError(f"--building-origin {self.building_origin!r} is not of the form EAST,NORTH in metres.")
        if self.level_m is not None or self.default_height_m is not None:
            raise RequestError("--level-height and --default-height go with footprints, not with a mesh.")
        return {
            "name": self.buildings.name,
            "base64": base64.b64encode(read_mesh_bytes(self.buildings)),
            "heights": self.building_heights,
            "origin_east_m": origin[0],
            "origin_north_m": origin[1],
        }

    def put_on(self, grid: ElevationGrid) -> ElevationGrid:
        """The grid with the buildings of these options; the same where there are none.

        Raises RequestError, MeshError, CoverError, FrameError.
        """
        mesh = self.mesh()
        if self.buildings is None:
            if self.level_m is not None or self.default_height_m is not None:
                raise RequestError("--level-height and --default-height need --buildings FILE.")
            return grid
        from service.parts.cover import CoverParameters, covered

        from .products import request_of_fields

        cover: dict[str, object] = {"footprints": self._footprints()} if mesh is None else {"meshes": [mesh]}
        return covered(grid, request_of_fields({"cover": cover}, CoverParameters))

    def _footprints(self) -> dict[str, object]:
        assert self.buildings is not None, "asked only of a file"
        if self.building_origin is not None or self.building_heights != "above_ground":
            raise RequestError("--building-origin and --building-heights go with a mesh, not with footprints.")
        try:
            document = json.loads(self.buildings.read_text(encoding="utf-8-sig"))
        except OSError as error:
            raise RequestError(f"The buildings {str(self.buildings)!r} cannot be read: {error.strerror}.") from error
        except (UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
            raise RequestError(f"The buildings {self.buildings.name} are not GeoJSON: {error}.") from error
        if not isinstance(document, dict):
            raise RequestError(f"The buildings {self.buildings.name} hold no GeoJSON object.")
        return {"geojson": document, "level_m": self.level_m, "default_height_m": self.default_height_m}


BARE = CoverOptions()
