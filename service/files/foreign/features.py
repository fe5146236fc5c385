"""What reading another program's file gives: GeoJSON, how heights in it count, and what was not understood."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from lxml import etree

from service.errors import RequestError

__all__ = ["Allowance", "Feature", "Foreign", "counted", "parsed_xml", "place_of"]

# a feature of GeoJSON; altitudes of other programs stand in its properties, with the datum that they count from
Feature = dict[str, object]
LONGEST_TEXT = 200


@dataclass(slots=True)
class Allowance:
    """How many places a file may hold, looked at while it is read: what has too many is refused before it is made."""

    called: str
    most_places: int | None = None
    places: int = 0

    def take(self, number: int) -> None:
        """So many places more. Raises RequestError."""
        self.places += number
        self.refuse(self.places)

    def refuse(self, number: int) -> None:
        """Raises RequestError where so many are too many."""
        if self.most_places is not None and number > self.most_places:
            raise RequestError(f"{self.called} holds more than {self.most_places:,} places, which no mission has.")


@dataclass(frozen=True, slots=True)
class Foreign:
    """format: in words. features: of GeoJSON, in WGS 84 degrees. told: sentences about what was left out, or assumed.

    A Point's properties are fields of an anchor as far as the file has them: id, above_ground_m or altitude_m with
    altitude_datum; ``what`` is what the file says it is (way-point, no-go, keep-in, rally point …).
    """

    format: str
    features: tuple[Feature, ...]
    told: tuple[str, ...] = ()

    def only(self, kind: str, called: str) -> tuple[dict[str, object], tuple[str, ...]]:
        """(a FeatureCollection of the geometries of that kind, told about the others too). Raises RequestError."""
        taken = [one for one in self.features if _kind(one) == kind]
        others = Counter(_kind(one) for one in self.features if _kind(one) != kind)
        if not taken:
            there = " and ".join(f"{number} × {other}" for other, number in sorted(others.items()))
            raise RequestError(f"{called} holds no {kind}{f', only {there}' if there else ''}.")
        left = counted(others.elements(), f"not taken; {kind}s were asked for.")
        return {"type": "FeatureCollection", "features": taken}, (*self.told, *left)


def _kind(feature: Feature) -> str:
    geometry = feature["geometry"]
    return str(geometry["type"]) if isinstance(geometry, dict) else ""


def place_of(kind: str, coordinates: object, id: str | None, properties: dict[str, object]) -> Feature:
    """A feature of one geometry."""
    own: dict[str, object] = {} if id is None else {"id": id[:LONGEST_TEXT]}
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", **own, "geometry": geometry, "properties": {**own, **properties}}


def counted(names: Iterable[str], what: str) -> list[str]:
    """A sentence about things that were passed over, with how many of each; none without any."""
    numbers = Counter(names)
    if not numbers:
        return []
    return [f"{', '.join(f'{number} × {name}' for name, number in sorted(numbers.items()))}: {what}"]


def parsed_xml(data: bytes, called: str, roots: Sequence[str]) -> etree._Element:
    """The root element of an XML document that declares no document type, for entities in one may be bombs.

    roots: names that it may have, without namespace. Raises RequestError.
    """
    parser = etree.XMLParser(
        resolve_entities=False, no_network=True, load_dtd=False, huge_tree=False, remove_comments=True, remove_pis=True
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError) as error:
        raise RequestError(f"{called} is no XML that can be read: {str(error)[:LONGEST_TEXT]}.") from error
    if root.getroottree().docinfo.doctype:
        raise RequestError(f"{called} declares a document type, which may hide entities; save it without.")
    name = etree.QName(root).localname
    if name not in roots:
        raise RequestError(f"{called} is XML of another kind ({name[:40]}), not {' or '.join(roots)}.")
    return root
