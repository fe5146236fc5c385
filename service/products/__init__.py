"""What a product is: one capability as one object, from which routes, jobs, layers and documents are derived."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, Protocol

from pydantic import BaseModel, JsonValue

from service.errors import RequestError
from service.estimates import Demand, refuse_beyond
from service.files.layer import Layer
from service.settings import Settings
from terrain import ElevationGrid

__all__ = ["UNWATCHED", "Finished", "Given", "Inline", "Needs", "Product", "WarmUp", "Work"]


class Finished(Protocol):
    """What a calculation leaves: the answer, and arrays that its layers are made of."""

    @property
    def grid(self) -> ElevationGrid:
        """The ground it lies on."""
        ...

    @property
    def answer(self) -> BaseModel:
        """What it says in numbers and words; JSON, tables, layers and pictures read this."""
        ...


def _unheard(share: float) -> None:
    """Nobody wants to hear the finished share."""


def _never() -> bool:
    return False


@dataclass(frozen=True, slots=True)
class Work:
    """What a calculation may use besides ground and question.

    progress: takes the finished share 0..1. stop: whether somebody wants the best so far. scheduler: address of a Dask
    scheduler. folder: where files lie that are too big for memory, until the layers are written; None: anywhere.
    """

    progress: Callable[[float], None] = _unheard
    stop: Callable[[], bool] = _never
    scheduler: str | None = None
    folder: Path | None = None

    def part(self, begin: float, end: float) -> Callable[[float], None]:
        """Progress of one part of the work, from one share of the whole to another."""
        return lambda share: self.progress(begin + (end - begin) * share)


UNWATCHED = Work()


@dataclass(frozen=True, slots=True)
class Needs:
    """What a request refers to that only the service knows: a finished map, or what a detector session found."""

    map_id: str | None = None
    map_kinds: tuple[str, ...] = ()
    detector_id: str | None = None
    persistent_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Given:
    """The same, found: which kind of map with which parameters, and which anchors are occluded for so long.

    map_ground: the digest of the ground that a map of a file was made of, buildings included; None where not known.
    """

    map_kind: str | None = None
    map_parameters: Mapping[str, Any] = field(default_factory=dict)
    occluded: tuple[str, ...] = ()
    map_ground: str | None = None


@dataclass(frozen=True, slots=True)
class Inline:
    """A long part of the answer that lies on disk as the JSON of a layer, and is put into the answer unread."""

    name: str
    layer: str
    model: Any
    description: str


@dataclass(frozen=True, slots=True)
class WarmUp:
    """Calls that compile a product's kernels, on a tiny grid with an unknown post, with the types of real requests.

    when: "maps" holds what a fast visibility map calls, and so most products; "beside" may be compiled at the same
    time, since it makes no maps; "after" waits for them. own_processes: it starts some, which compile for themselves.
    """

    call: Callable[[ElevationGrid], None]
    when: Literal["maps", "beside", "after"] = "after"
    own_processes: bool = False


def _takes_nothing(grid: ElevationGrid, parameters: Any) -> Iterable[Demand]:
    return ()


def _refuses_nothing(grid: ElevationGrid, parameters: Any, settings: Settings) -> None:
    """Whatever the parameters can say can be calculated."""


def _needs_nothing(asked: Any) -> Needs | None:
    return None


def _packed(grid: ElevationGrid, parameters: Any, folder: Path) -> dict[str, JsonValue]:
    packed: dict[str, JsonValue] = parameters.model_dump(mode="json", exclude_none=True)
    return packed


@dataclass(frozen=True, slots=True, eq=False)
class Product:
    """One capability of the service.

    name: of its jobs, as in ``dop-map``; plural: the field of its lists and, with hyphens, its path. model: the stem of
    the names in OpenAPI. asked: the body of POST; parameters: the same without what names things of the service.
    check: refuses what cannot be calculated; estimate: what it takes of what an operator limits, what is known soonest
    first. Both allocate nothing big. warm_up: what compiles its kernels.
    load: the inverse of what ``calculate`` left on disk; None where all layers are written at once and nothing is kept.
    pack, unpack: what of the parameters stays in the store, and the whole of them again in the worker.
    needs, complete: what a request refers to, and the parameters with it. searches: it can be ended early.
    """

    name: str
    title: str
    plural: str
    tag: str
    about: str
    summary: str
    model: str
    asked: type[BaseModel]
    parameters: type[BaseModel]
    answer: type[BaseModel]
    calculate: Callable[[ElevationGrid, Any, Work], Finished]
    layers: tuple[Layer, ...]
    estimate: Callable[[ElevationGrid, Any], Iterable[Demand]] = _takes_nothing
    check: Callable[[ElevationGrid, Any, Settings], None] = _refuses_nothing
    warm_up: tuple[WarmUp, ...] = ()
    example: Mapping[str, Any] = field(default_factory=dict)
    finished: Callable[..., Finished] | None = None
    arrays: tuple[str, ...] = ()
    needs: Callable[[Any], Needs | None] = _needs_nothing
    complete: Callable[[Any, Given], BaseModel] | None = None
    pack: Callable[[ElevationGrid, Any, Path], dict[str, JsonValue]] = _packed
    unpack: Callable[[Mapping[str, Any], Path], Any] | None = None
    long_body: bool = False
    inline: Inline | None = None
    searches: bool = False
    problems: tuple[int, ...] = ()

    @property
    def path(self) -> str:
        """Where its resources are found."""
        return f"/{self.plural.replace('_', '-')}"

    @property
    def layer(self) -> Mapping[str, Layer]:
        """Its layers by file name."""
        return MappingProxyType({layer.name: layer for layer in self.layers})

    def refuse(self, grid: ElevationGrid, parameters: Any, settings: Settings) -> None:
        """Raises LimitError for what would take too much, and what ``check`` and ``estimate`` raise."""
        self.check(grid, parameters, settings)
        refuse_beyond(self.estimate(grid, parameters), settings)

    def completed(self, asked: Any, given: Given) -> Any:
        """The parameters that a request makes, with what it refers to. Raises RequestError, ValidationError."""
        if self.complete is not None:
            return self.complete(asked, given)
        if given.map_kind is not None or given.occluded:
            raise RequestError(f"A {self.title} refers to no map and no detector.")
        return self.parameters.model_validate(asked.model_dump(mode="json", exclude={"dem_id"}, exclude_unset=True))

    def unpacked(self, packed: Mapping[str, Any], folder: Path) -> Any:
        """The parameters of a job, from what the store and its folder of inputs hold."""
        return self.parameters.model_validate(packed) if self.unpack is None else self.unpack(packed, folder)
