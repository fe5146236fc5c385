"""One table from error class to kind of problem: its stable name, HTTP status and title."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from detection import errors as of_detection
from gnss import errors as of_gnss
from navigation import errors as of_navigation
from planning import errors as of_planning
from service import errors as ours
from service.error_roots import domain_errors
from terrain import errors as of_terrain
from visibility import errors as of_visibility

__all__ = [
    "FRAMEWORK_KINDS",
    "INTERNAL",
    "KIND_BY_ERROR_NAME",
    "KIND_BY_PACKAGE",
    "METHOD",
    "PROBLEMS",
    "ProblemKind",
]


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A kind of problem: its stable name, HTTP status and title."""

    name: str
    status: int
    title: str


PROBLEMS: Mapping[type[Exception], ProblemKind] = {
    of_terrain.TerrainError: ProblemKind("terrain", 422, "The ground cannot be used"),
    of_terrain.ElevationGridError: ProblemKind("elevation-grid", 422, "The heights do not make a grid"),
    of_terrain.DemReadError: ProblemKind("dem-read", 422, "The file cannot be read as a DEM"),
    of_terrain.DemFormatError: ProblemKind("dem-format", 422, "The file is not a DEM"),
    of_terrain.DemTooLargeError: ProblemKind("dem-too-large", 422, "The DEM has too many cells"),
    of_terrain.DemUnsupportedError: ProblemKind("dem-unsupported", 422, "The raster cannot serve as a DEM"),
    of_terrain.NoGroundError: ProblemKind("no-ground", 422, "There is no ground in the area"),
    of_terrain.GroundChangedError: ProblemKind("ground-changed", 409, "The ground library was changed"),
    of_terrain.GroundSourceError: ProblemKind("ground-source", 502, "A source of ground fails"),
    of_terrain.AreaError: ProblemKind("ground-area", 422, "The area cannot be used"),
    of_terrain.FrameError: ProblemKind("frame", 422, "The position or CRS does not fit the DEM"),
    of_terrain.VerticalDatumError: ProblemKind("vertical-datum", 422, "Heights cannot be brought to that datum"),
    of_terrain.SampleError: ProblemKind("sample", 404, "There is no such bundled DEM"),
    of_visibility.VisibilityError: ProblemKind("visibility", 422, "The question cannot be answered"),
    of_visibility.AnchorError: ProblemKind("anchor", 422, "An anchor cannot be used"),
    of_visibility.VisibilityInputError: ProblemKind("visibility-input", 422, "The question cannot be answered"),
    of_visibility.MeshError: ProblemKind("mesh", 422, "A building mesh cannot be used"),
    of_visibility.CoverError: ProblemKind("cover", 422, "Buildings or canopy cannot be used"),
    of_visibility.SignalError: ProblemKind("signal", 422, "A radio or a link cannot be used"),
    of_gnss.GnssError: ProblemKind("gnss", 422, "The satellites cannot be used"),
    of_gnss.GnssInputError: ProblemKind("gnss-input", 422, "The question cannot be answered"),
    of_gnss.GnssLibraryError: ProblemKind("gnss-library", 503, "A library is not installed"),
    of_gnss.SamplesError: ProblemKind("samples", 422, "The samples cannot be used"),
    of_gnss.AlmanacError: ProblemKind("almanac", 422, "The satellites' orbits cannot be used"),
    of_gnss.AlmanacFileError: ProblemKind("almanac-file", 422, "The almanac file cannot be read"),
    of_planning.PlanningError: ProblemKind("planning", 422, "The plan cannot be made"),
    of_planning.PlacementError: ProblemKind("placement", 422, "The anchors cannot be placed"),
    of_planning.NoCandidateError: ProblemKind("no-candidate", 422, "No place is left for an anchor"),
    of_planning.WatchError: ProblemKind("watch", 422, "The map cannot be looked at"),
    of_planning.PathError: ProblemKind("path", 422, "The path cannot be planned"),
    of_planning.PathProblemError: ProblemKind("path-problem", 422, "Rover, limits or budget make no question"),
    of_planning.AreaError: ProblemKind("area", 422, "An area cannot be used"),
    of_planning.PlaceError: ProblemKind("place", 422, "A place cannot be used"),
    of_planning.NoCoverageError: ProblemKind("no-coverage", 422, "The limits on positioning hold nowhere"),
    of_planning.PlanningProcessError: ProblemKind("planning-process", 500, "The planner ended before its answer"),
    of_planning.ClusterError: ProblemKind("cluster", 503, "The cluster cannot be used"),
    ours.ClusterSetUpError: ProblemKind("cluster-set-up", 503, "A machine of the cluster is not set up"),
    of_detection.DetectionError: ProblemKind("detection", 422, "The detector cannot be run"),
    of_detection.DetectionInputError: ProblemKind("detection-input", 422, "Anchors or settings make no sense"),
    of_navigation.NavigationError: ProblemKind("navigation", 422, "The question cannot be answered"),
    of_navigation.StateError: ProblemKind("state", 422, "A covariance is none"),
    of_navigation.MeasurementError: ProblemKind("measurement", 422, "Ranges or their errors cannot be used"),
    of_navigation.TimeOrderError: ProblemKind("time-order", 422, "Times go backwards"),
    of_navigation.BubbleError: ProblemKind("bubble", 422, "A safety bubble cannot be asked for"),
    ours.ServiceError: ProblemKind("service", 500, "The service failed"),
    ours.StartError: ProblemKind("start", 503, "The service cannot start"),
    ours.DataFolderError: ProblemKind("data-folder", 503, "The data folder cannot be used"),
    ours.DataFolderInUseError: ProblemKind("data-folder-in-use", 503, "The data folder is in use"),
    ours.StoreServerError: ProblemKind("store-server", 503, "The server of the job store cannot be used"),
    ours.AddressError: ProblemKind("address", 503, "The address cannot be used"),
    ours.KeysError: ProblemKind("keys", 503, "Keys cannot be checked"),
    ours.AccessError: ProblemKind("access", 403, "Access is refused"),
    ours.HostError: ProblemKind("host", 421, "The request is for another host"),
    ours.OriginError: ProblemKind("origin", 403, "The request comes from another web page"),
    ours.UnauthenticatedError: ProblemKind("unauthenticated", 401, "A key is needed"),
    ours.ForbiddenError: ProblemKind("forbidden", 403, "The key does not have that scope"),
    ours.StoreLockedError: ProblemKind("store-locked", 503, "The job store is locked"),
    ours.StoppingError: ProblemKind("stopping", 503, "The service is stopping"),
    ours.NotFoundError: ProblemKind("not-found", 404, "There is no such resource"),
    ours.GoneError: ProblemKind("gone", 410, "The resource is over"),
    ours.DemUnderWayError: ProblemKind("dem-under-way", 409, "The DEM is being made"),
    ours.NotReadyError: ProblemKind("not-ready", 409, "The job is not ready for that"),
    ours.InUseError: ProblemKind("in-use", 409, "The resource is in use"),
    ours.EditConflictError: ProblemKind("edit-conflict", 412, "Somebody else saved since"),
    ours.NoPreconditionError: ProblemKind("no-precondition", 428, "The request does not say what it builds on"),
    ours.RequestError: ProblemKind("request", 422, "The request makes no sense"),
    ours.TooSlowError: ProblemKind("too-slow", 408, "The request came too slowly"),
    ours.NotJsonError: ProblemKind("not-json", 400, "The body is not JSON"),
    ours.NotValidError: ProblemKind("validation", 422, "The request does not validate"),
    ours.MediaTypeError: ProblemKind("media-type", 415, "The body has an unknown type"),
    ours.RangeError: ProblemKind("range", 416, "The file does not have that range"),
    ours.LimitError: ProblemKind("limit", 422, "The request is beyond a limit"),
    ours.BodyTooLargeError: ProblemKind("body-too-large", 413, "The body is too large"),
    ours.TooManyError: ProblemKind("too-many", 429, "There are too many"),
    ours.BusyError: ProblemKind("busy", 503, "The service is busy"),
    ours.JobError: ProblemKind("job", 500, "The job failed"),
    ours.TimeLimitError: ProblemKind("time-limit", 422, "The calculation took too long"),
    ours.MemoryLimitError: ProblemKind("memory-limit", 422, "The calculation needs too much memory"),
    ours.StorageFullError: ProblemKind("storage-full", 507, "There is no space left"),
    ours.JobInterruptedError: ProblemKind("interrupted", 500, "The job was interrupted"),
    ours.JobCancelledError: ProblemKind("cancelled", 409, "The job was cancelled"),
    ours.InternalError: ProblemKind("internal", 500, "Internal error"),
}
KIND_BY_ERROR_NAME = {f"{cls.__module__.partition('.')[0]}.{cls.__name__}": kind for cls, kind in PROBLEMS.items()}
# Sentences of these packages are meant for whoever asked, also those of an error that has no row of its own yet.
KIND_BY_PACKAGE = {package: PROBLEMS[base] for package, base in domain_errors().items()}
INTERNAL = PROBLEMS[ours.InternalError]
METHOD = ProblemKind("method", 405, "The method is not allowed here")
# What the framework itself finds wrong.
FRAMEWORK_KINDS = {
    400: PROBLEMS[ours.NotJsonError],
    404: PROBLEMS[ours.NotFoundError],
    405: METHOD,
    422: PROBLEMS[ours.NotValidError],
}
