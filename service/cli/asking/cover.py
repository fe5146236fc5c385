"""What stands on the ground of a command: ``--buildings`` and what goes with it; the ``cover`` of a request."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from service.errors import RequestError

if TYPE_CHECKING:
    from terrain import ElevationGrid

__all__ = ["BARE", "CoverOptions"]

OF_FOOTPRINTS = (".geojson", ".json")
FoliageName = Literal["density", "weissberger", "early_itu", "p833_slant", "p833_woodland"]


@Parameter(name="*")
@dataclass(frozen=True, slots=True)
class CoverOptions:
    """What stands on the DEM: buildings hide in every command, and nobody goes through them; trees weaken signals."""

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

    canopy: Annotated[
        Path | None,
        Parameter(
            name="--canopy", metavar="FILE", help="Trees on the ground: a raster of crown heights over it, metres."
        ),
    ] = None
    canopy_surface: Annotated[
        Path | None,
        Parameter(
            name="--canopy-surface",
            metavar="FILE",
            help="A surface model instead: what it has above the DEM.",
        ),
    ] = None
    canopy_top_m: Annotated[
        float | None, Parameter(name="--canopy-height", metavar="M", help="Trees of one height everywhere instead.")
    ] = None
    canopy_base_m: Annotated[
        float | None, Parameter(name="--canopy-base", metavar="M", help="Where crowns begin, metres over the ground.")
    ] = None
    canopy_bases: Annotated[
        Path | None,
        Parameter(name="--canopy-bases", metavar="FILE", help="A raster of where they begin, metres over the ground."),
    ] = None
    canopy_model: Annotated[
        FoliageName | None,
        Parameter(name="--canopy-model", help="What a way through them costs a signal. (default weissberger)"),
    ] = None
    depth_per_m: Annotated[
        float | None,
        Parameter(name="--canopy-density", metavar="DEPTH", help="Optical depth per metre, for the model density."),
    ] = None
    canopy_densities: Annotated[
        Path | None,
        Parameter(name="--canopy-densities", metavar="FILE", help="A raster of the same, 1/m."),
    ] = None
    canopy_fit: Annotated[
        Path | None,
        Parameter(
            name="--canopy-fit", metavar="FILE", help="canopy.json of sightline canopy fit: its density, and its trees."
        ),
    ] = None
    season: Annotated[
        float | None, Parameter(name="--canopy-season", metavar="FACTOR", help="Factor on that cost. (default 1)")
    ] = None

    @property
    def bare(self) -> bool:
        """Whether nothing stands there."""
        return self == CoverOptions()

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
        from visibility import MeshError
        from visibility.cover.mesh_files import FORMATS, read_mesh_bytes

        if self.buildings.suffix.lower() not in FORMATS:
            known = ", ".join((*OF_FOOTPRINTS, *FORMATS))
            raise MeshError(
                f"{self.buildings.name} is neither GeoJSON of footprints nor a mesh format that is read; "
                f"use one of {known}."
            )

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
        mesh, (cover, told) = self.mesh(), self._trees()
        if self.buildings is not None:
            cover |= {"footprints": self._footprints()} if mesh is None else {"meshes": [mesh]}
        elif self.level_m is not None or self.default_height_m is not None:
            raise RequestError("--level-height and --default-height need --buildings FILE.")
        if not cover:
            return grid
        from service.parts.cover import CoverParameters, covered

        from .products import request_of_fields

        built = covered(grid, request_of_fields({"cover": cover}, CoverParameters))
        warnings = (*built.provenance.warnings, *told)
        return replace(built, provenance=replace(built.provenance, warnings=warnings)) if told else built

    def _trees(self) -> tuple[dict[str, object], list[str]]:
        """(the canopy of a cover, nothing without one; what there is to tell of it)."""
        dense = self.depth_per_m is not None or self.canopy_densities is not None
        options = {
            "top_m": self.canopy_top_m,
            "base_m": self.canopy_base_m,
            "model": self.canopy_model or ("density" if dense else None),
            "depth_per_m": self.depth_per_m,
            "season": self.season,
        }
        given: dict[str, object] = {name: value for name, value in options.items() if value is not None}
        told: list[str] = []
        if self.canopy_fit is not None:
            given, told = self._fitted(self.canopy_fit, given)
        rasters = {
            "heights": self.canopy,
            "surface": self.canopy_surface,
            "bases": self.canopy_bases,
            "densities": self.canopy_densities,
        }
        for name, path in rasters.items():
            if path is None:
                continue
            try:
                given[name] = {"name": path.name, "base64": base64.b64encode(path.read_bytes())}
            except OSError as error:
                raise RequestError(f"The canopy {str(path)!r} cannot be read: {error.strerror}.") from error
        if given and not given.keys() & {"heights", "surface", "top_m"}:
            raise RequestError("Trees need --canopy FILE, --canopy-surface FILE or --canopy-height M.")
        return {"canopy": given} if given else {}, told

    def _fitted(self, path: Path, given: dict[str, object]) -> tuple[dict[str, object], list[str]]:
        """(the canopy of a fit with what is given besides, which wins; what of the fit does not hold, told).

        Raises RequestError.
        """
        if given.keys() & {"model", "depth_per_m"}:
            raise RequestError(
                "--canopy-fit brings its density along; leave out --canopy-model, --canopy-density and "
                "--canopy-densities."
            )
        try:
            fitted = json.loads(path.read_text(encoding="utf-8"))["canopy"]
        except OSError as error:
            raise RequestError(f"The fit {str(path)!r} cannot be read: {error.strerror}.") from error
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise RequestError(f"The fit {path.name} is no canopy.json of sightline canopy fit.") from error
        if not isinstance(fitted, dict):
            raise RequestError(f"The fit {path.name} has no canopy: fit it with --canopy-height, or with a DEM.")
        others: dict[str, object] = {"top_m": self.canopy_top_m, "base_m": self.canopy_base_m}
        told = [
            f"The fit {path.name} is of {what} {fitted[name]:g} m; {option} {others[name]:g} m holds, with its density."
            for name, what, option in (
                ("top_m", "trees of", "--canopy-height"),
                ("base_m", "crowns from", "--canopy-base"),
            )
            if others[name] is not None and isinstance(fitted.get(name), int | float) and fitted[name] != others[name]
        ]
        raster = self.canopy or self.canopy_surface
        top_m = None if raster is None else fitted.pop("top_m", None)
        if raster is not None and isinstance(top_m, int | float):
            heights = f"The fit {path.name} is of trees of {top_m:g} m"
            told.append(f"{heights}; those of {raster.name} hold, with its density.")
        return {**fitted, **given}, told

    def _footprints(self) -> dict[str, object]:
        assert self.buildings is not None, "asked only of a file"
        if self.building_origin is not None or self.building_heights != "above_ground":
            raise RequestError("--building-origin and --building-heights go with a mesh, not with footprints.")
        try:
            document = json.loads(self.buildings.read_text(encoding="utf-8-sig"))
        except OSError as error:
            raise RequestError(f"The buildings {str(self.buildings)!r} cannot be read: {error.strerror}.") from error
        except (ValueError, RecursionError) as error:
            raise RequestError(f"The buildings {self.buildings.name} are not GeoJSON: {error}.") from error
        if not isinstance(document, dict):
            raise RequestError(f"The buildings {self.buildings.name} hold no GeoJSON object.")
        return {"geojson": document, "level_m": self.level_m, "default_height_m": self.default_height_m}


BARE = CoverOptions()
