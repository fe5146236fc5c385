"""``--doubts``: what ranges of earlier drives said against the DEM, as the ``doubts`` of a request."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from service.errors import RequestError

from .options import GROUP, option

__all__ = ["TRUSTING", "DoubtOptions"]


@GROUP
@dataclass(frozen=True, slots=True)
class DoubtOptions:
    """Where a session's ranges contradicted the DEM: sight is trusted less there."""

    doubts: Annotated[
        Path | None,
        option(
            "map_doubts.geojson of sightline detect --dem, or of a session: where ranges denied an anchor's sight, it "
            "is unknown.",
            "FILE",
        ),
    ] = None
    doubts_reach_m: Annotated[
        float | None,
        option("How far beside its line a doubt holds, one sigma. (default two cells)", "M", "--doubts-reach"),
    ] = None

    def part(self) -> dict[str, object]:
        """The request's field, where there are doubts. Raises RequestError."""
        if self.doubts is None:
            if self.doubts_reach_m is not None:
                raise RequestError("--doubts-reach needs --doubts FILE.")
            return {}
        try:
            document = json.loads(self.doubts.read_text(encoding="utf-8-sig"))
        except OSError as error:
            raise RequestError(f"The doubts {str(self.doubts)!r} cannot be read: {error.strerror}.") from error
        except (ValueError, RecursionError) as error:
            raise RequestError(f"The doubts {self.doubts.name} are not GeoJSON: {error}.") from error
        if not isinstance(document, dict):
            raise RequestError(f"The doubts {self.doubts.name} hold no GeoJSON object.")
        return {"doubts": {"geojson": document, "reach_m": self.doubts_reach_m}}


TRUSTING = DoubtOptions()
