"""Positions, places and shapes on the ground, as requests write them, and what parts with altitudes have."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from terrain import VerticalDatumError, parse_vertical_datum

__all__ = [
    "LARGEST",
    "BoxDegreesIn",
    "BoxMetresIn",
    "CircleIn",
    "DegreesEast",
    "DegreesNorth",
    "InADatum",
    "Metres",
    "NotNegative",
    "NotNegativeMetres",
    "Number",
    "PlaceIn",
    "PlanAltitudes",
    "PointIn",
    "PolygonIn",
    "Positive",
    "StandOffIn",
    "StrictModel",
    "WeightIn",
]

# Beyond any length, time or weight that is meant; what is far larger overflows once it is squared.
LARGEST = 1e12
# Strict: "12" and true are not numbers. NaN and infinities are no positions.
Number = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-LARGEST, le=LARGEST)]
NotNegative = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=0.0, le=LARGEST)]
Positive = Annotated[float, Field(strict=True, allow_inf_nan=False, gt=0.0, le=LARGEST)]
Metres = Number
NotNegativeMetres = NotNegative
DegreesEast = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-180.0, le=360.0)]
DegreesNorth = Annotated[float, Field(strict=True, allow_inf_nan=False, ge=-90.0, le=90.0)]
PlanAltitudes = Annotated[
    Literal["sea level", "ground"],
    Field(
        description="What altitudes in QGroundControl's plans count from: sea level, or the ground below "
        "(MAV_FRAME_GLOBAL_TERRAIN_ALT), for which the vehicle needs terrain data."
    ),
]


class StrictModel(BaseModel):
    """A request body: frozen, and a misspelt field is an error."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def _known(name: str) -> str:
    try:
        parse_vertical_datum(name)
    except VerticalDatumError as error:
        raise ValueError(str(error)) from error
    return name


class InADatum(StrictModel):
    """A part of a request with altitudes: ``altitude_fields`` names them, ``altitude_datum`` what they count from."""

    altitude_fields: ClassVar[tuple[str, ...]] = ("altitude_m",)

    altitude_datum: Annotated[str, Field(max_length=60), AfterValidator(_known)] | None = Field(
        None,
        description="What the altitude here counts from: msl (mean sea level), hae (the WGS 84 ellipsoid), EGM96, "
        "EGM2008, or a vertical CRS such as EPSG:5703; left out = as the DEM's heights.",
    )

    @model_validator(mode="after")
    def _a_datum_of_something(self) -> Self:
        if self.altitude_datum is not None and not self.altitudes():
            raise ValueError(f"altitude_datum goes with {' or '.join(self.altitude_fields)}.")
        return self

    def altitudes(self) -> tuple[str, ...]:
        """The fields that hold altitudes here."""
        return tuple(name for name in self.altitude_fields if getattr(self, name) not in (None, []))


class PointIn(InADatum):
    """Where something is: one horizontal pair, in the DEM's metric CRS or in degrees, and one height."""

    model_config = ConfigDict(
        json_schema_extra={"examples": [{"east_m": 402300.0, "north_m": 3795200.0, "above_ground_m": 2.0}]}
    )

    east_m: Metres | None = Field(None, description="East in the DEM's metric CRS, metres; goes with north_m.")
    north_m: Metres | None = Field(None, description="North in the DEM's metric CRS, metres; goes with east_m.")
    lon_deg: DegreesEast | None = Field(
        None, description="Longitude, degrees east (WGS 84, or the DEM's own body); goes with lat_deg."
    )
    lat_deg: DegreesNorth | None = Field(None, description="Latitude, degrees north; goes with lon_deg.")
    body: str | None = Field(
        None,
        max_length=80,
        description="Body whose degrees lon_deg and lat_deg are, such as Earth or Moon; left out = the DEM's own.",
    )
    above_ground_m: NotNegativeMetres | None = Field(
        None, description="Height above the DEM's surface at that place, metres; or give altitude_m."
    )
    altitude_m: Metres | None = Field(None, description="Height above altitude_datum, metres; or give above_ground_m.")

    @model_validator(mode="after")
    def _one_pair_and_one_height(self) -> Self:
        metres, degrees = (self.east_m, self.north_m), (self.lon_deg, self.lat_deg)
        whole = [all(v is not None for v in pair) for pair in (metres, degrees)]
        begun = [any(v is not None for v in pair) for pair in (metres, degrees)]
        if sum(whole) != 1 or whole != begun:
            raise ValueError(f"{self._called()}: give exactly one of the pairs east_m, north_m or lon_deg, lat_deg.")
        if self.body is not None and self.lon_deg is None:
            raise ValueError(f"{self._called()}: body goes with lon_deg and lat_deg.")
        if (self.above_ground_m is None) == (self.altitude_m is None):
            given = "neither was" if self.altitude_m is None else "both were"
            raise ValueError(f"{self._called()}: give exactly one of above_ground_m and altitude_m; {given} given.")
        return self

    def _called(self) -> str:
        """How error sentences name this position."""
        return "Point"


class PlaceIn(StrictModel):
    """A place on the ground: one pair, in the DEM's metric CRS or in degrees."""

    east_m: Metres | None = Field(None, description="East in the DEM's metric CRS, metres; goes with north_m.")
    north_m: Metres | None = Field(None, description="North in the DEM's metric CRS, metres; goes with east_m.")
    lon_deg: DegreesEast | None = Field(None, description="Longitude, degrees east; goes with lat_deg.")
    lat_deg: DegreesNorth | None = Field(None, description="Latitude, degrees north; goes with lon_deg.")
    body: str | None = Field(
        None,
        max_length=80,
        description="Body whose degrees lon_deg and lat_deg are, such as Earth or Moon; left out = the DEM's own.",
    )

    @model_validator(mode="after")
    def _one_pair(self) -> Self:
        metres, degrees = (self.east_m, self.north_m), (self.lon_deg, self.lat_deg)
        whole = [all(v is not None for v in pair) for pair in (metres, degrees)]
        begun = [any(v is not None for v in pair) for pair in (metres, degrees)]
        if sum(whole) != 1 or whole != begun:
            raise ValueError("A place needs exactly one of the pairs east_m, north_m or lon_deg, lat_deg.")
        if self.body is not None and self.lon_deg is None:
            raise ValueError("A place: body goes with lon_deg and lat_deg.")
        return self


class BoxDegreesIn(StrictModel):
    """All between two meridians and two parallels; with west > east over the antimeridian."""

    west_deg: DegreesEast = Field(description="Western side, longitude, degrees.")
    south_deg: DegreesNorth = Field(description="Southern side, latitude, degrees.")
    east_deg: DegreesEast = Field(description="Eastern side, longitude, degrees.")
    north_deg: DegreesNorth = Field(description="Northern side, latitude, degrees.")


class BoxMetresIn(StrictModel):
    """All between two eastings and two northings."""

    west_m: Metres = Field(description="Western side, east coordinate, metres.")
    south_m: Metres = Field(description="Southern side, north coordinate, metres.")
    east_m: Metres = Field(description="Eastern side, east coordinate, metres.")
    north_m: Metres = Field(description="Northern side, north coordinate, metres.")


class CircleIn(PlaceIn):
    """All within a distance of a place."""

    radius_m: Positive = Field(description="Distance over ground, metres.")


Ring = Annotated[list[PlaceIn], Field(min_length=3, max_length=10_000)]


class PolygonIn(StrictModel):
    """A polygon: its outer ring, closed or not, and holes."""

    ring: Ring = Field(description="Corners of the outer ring in order, at least three entries.")
    holes: list[Ring] = Field([], description="Rings that are left out.")


class WeightIn(StrictModel):
    """Ground that counts more, less or nothing."""

    polygon: PolygonIn = Field(description="Which ground.")
    weight: NotNegative = Field(description="What each post in it counts beside the rest, no unit; 0 leaves it out.")


class StandOffIn(StrictModel):
    """What to keep away from: a point, a line or a polygon, and how far."""

    places: Annotated[list[PlaceIn], Field(min_length=1, max_length=10_000)] = Field(
        description="One place is a point, several are a line; closed, a line is the border of an area kept off too."
    )
    distance_m: NotNegativeMetres = Field(description="Distance to keep, metres.")
