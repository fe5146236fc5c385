"""The command of the toy product: what another package writes so that its product is asked on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import BaseModel
from rich.table import Table

from service.cli.asking.options import DemPath, Output, Reading, RequestFile, option
from service.cli.asking.products import ask, request_of_fields
from service.cli.output import facts_table
from service.errors import RequestError
from tests.service.toy_product import HIGH_GROUND, HighGroundParameters, HighGroundSummary

__all__ = ["high_ground"]


def high_ground(
    dem: DemPath,
    /,
    *,
    above: Annotated[float | None, option("Height, metres.", "M")] = None,
    request: RequestFile = None,
    reading: Reading = Reading(),
    output: Output = Output(),
) -> None:
    """Tell how much of a DEM lies higher than a height."""
    asked: BaseModel | Path | None = request
    if asked is None:
        if above is None:
            raise RequestError("Give --above or --request.")
        asked = request_of_fields({"above_m": above}, HighGroundParameters)
    ask(HIGH_GROUND, dem, asked, _tables, summary="high_ground.json", reading=reading, output=output)


def _tables(answer: HighGroundSummary) -> tuple[Table, ...]:
    return (facts_table("High ground", [("posts", f"{answer.posts:,}")]),)
