"""Servers of ground that an operator lists."""

from __future__ import annotations

import string
from typing import Literal, Self
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, model_validator

__all__ = ["GroundSource"]

Scheme = Literal["copernicus-glo-30", "copernicus-glo-90", "srtm", "template"]

COPERNICUS = "{base}/Copernicus_DSM_COG_{step}_{NS}{lat:02d}_00_{EW}{lon:03d}_00_DEM/"
COPERNICUS_FILE = "Copernicus_DSM_COG_{step}_{NS}{lat:02d}_00_{EW}{lon:03d}_00_DEM.tif"
# (template, EPSG code of the vertical CRS where the files do not say it)
SCHEMES = {
    "copernicus-glo-30": ((COPERNICUS + COPERNICUS_FILE).replace("{step}", "10"), 3855),
    "copernicus-glo-90": ((COPERNICUS + COPERNICUS_FILE).replace("{step}", "30"), 3855),
    "srtm": ("{base}/{NS}{lat:02d}{EW}{lon:03d}.hgt", None),
}
PLACES = {"base", "NS", "EW", "lat", "lon"}


class GroundSource(BaseModel):
    """A server of ground that the operator lists, and how its files are called: one per degree by degree."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    base: str = Field(description="Where the files lie, such as https://copernicus-dem-30m.s3.amazonaws.com.")
    scheme: Scheme = Field("template", description="How files are called.")
    template: str | None = Field(
        None, description="With scheme template: {base}, {NS}, {lat:02d}, {EW} and {lon:03d} of the south-west corner."
    )

    @model_validator(mode="after")
    def _says_where_files_lie(self) -> Self:
        if urlsplit(self.base).scheme not in ("http", "https") or not urlsplit(self.base).netloc:
            raise ValueError(f"base must be an http or https address, not {self.base!r}.")
        if (self.scheme == "template") != (self.template is not None):
            raise ValueError("Give a template with scheme 'template', and with no other.")
        named = {name for _, name, _, _ in string.Formatter().parse(self._template) if name is not None}
        if not named <= PLACES or not self._template.startswith("{base}/"):
            raise ValueError(f"The template must begin with {{base}}/ and may hold {', '.join(sorted(PLACES))} only.")
        return self

    @property
    def vertical_epsg(self) -> int | None:
        """The vertical CRS of the scheme's files, which do not say it themselves."""
        return None if self.scheme == "template" else SCHEMES[self.scheme][1]

    def url_of(self, west_deg: int, south_deg: int) -> str:
        """The address of the file of one cell, by its south-west corner."""
        return self._template.format(
            base=self.base.rstrip("/"),
            NS="N" if south_deg >= 0 else "S",
            EW="E" if west_deg >= 0 else "W",
            lat=abs(south_deg),
            lon=abs(west_deg),
        )

    @property
    def _template(self) -> str:
        return self.template or SCHEMES[self.scheme][0]
