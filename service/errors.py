"""What can go wrong in the service itself; how each is answered over HTTP is told in service/http/problem_kinds.py.

ServiceError
├── StartError                 the service cannot start as it was told to
│   ├── KeysError              keys or tokens cannot be checked as the settings say, or there are none
│   ├── DataFolderError        the data folder cannot be used, at the start or later
│   │   ├── DataFolderInUseError   another process works on it
│   │   └── StoreServerError   the PostgreSQL server of the job store cannot be used
│   └── AddressError           it cannot listen at that address
├── AccessError                who asks may not
│   ├── HostError              the request is for another host
│   ├── OriginError            a web page of somewhere else asks
│   ├── UnauthenticatedError   no key, or one that does not hold
│   └── ForbiddenError         the key does not have that scope
├── StoreLockedError           another program holds the job store's database
├── NotFoundError              no such resource; carries its kind and id
├── StoppingError              the service ends; the same request will do after its next start
├── GoneError                  it was there, and is over
├── NotReadyError              the job has no result (yet)
├── DemUnderWayError           the DEM is being made
├── InUseError                 a DEM cannot be deleted while jobs work on it
├── EditConflictError          somebody else saved since; carries version, saved_by and saved_at
├── NoPreconditionError        a change that does not say what it builds on
├── RequestError               a request that makes no sense
│   ├── NotJsonError           a body that is not JSON
│   ├── NotValidError          a body whose fields are not as they should be
│   ├── MediaTypeError         a body of a type that is not understood
│   ├── RangeError             a Range header that the file cannot meet
│   ├── TooSlowError           a body that comes so slowly that others would wait for it
│   └── LimitError             a request beyond a limit; carries limit_name, limit and given
│       ├── BodyTooLargeError
│       ├── TooManyError       too many of these by the same client; one has to end first
│       └── BusyError          too many at once; the same request will do later; carries retry_after_s
└── JobError                   a job that could not be finished
    ├── TimeLimitError
    ├── MemoryLimitError
    ├── StorageFullError       no space left to write a result or an upload
    ├── ClusterSetUpError      a machine of the cluster lacks the data folder, or has another Sightline
    ├── JobInterruptedError    its worker died more often than is tried again
    ├── JobCancelledError      somebody deleted it
    └── InternalError          a fault of ours; carries the reference under which the log tells more
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

__all__ = [
    "AccessError",
    "AddressError",
    "BodyTooLargeError",
    "BusyError",
    "ClusterSetUpError",
    "DataFolderError",
    "DataFolderInUseError",
    "DemUnderWayError",
    "EditConflictError",
    "ForbiddenError",
    "GoneError",
    "HostError",
    "InUseError",
    "InternalError",
    "JobCancelledError",
    "JobError",
    "JobInterruptedError",
    "KeysError",
    "LimitError",
    "MediaTypeError",
    "MemoryLimitError",
    "NoPreconditionError",
    "NotFoundError",
    "NotJsonError",
    "NotReadyError",
    "NotValidError",
    "OriginError",
    "RangeError",
    "RequestError",
    "ServiceError",
    "StartError",
    "StoppingError",
    "StorageFullError",
    "StoreLockedError",
    "StoreServerError",
    "TimeLimitError",
    "TooManyError",
    "TooSlowError",
    "UnauthenticatedError",
]


class ServiceError(Exception):
    """Base of everything that the service raises on purpose."""


class StartError(ServiceError):
    """The service cannot start as it was told to."""


class DataFolderError(StartError):
    """The data folder cannot be used."""


class DataFolderInUseError(DataFolderError):
    """Another process works on the data folder."""


class StoreServerError(DataFolderError):
    """The PostgreSQL server that keeps the job store cannot be used."""


class AddressError(StartError):
    """The service cannot listen at the address it was given."""


class KeysError(StartError):
    """Keys or tokens cannot be checked as the settings say, or there are none where there must be."""


class AccessError(ServiceError):
    """Whoever asks may not."""


class HostError(AccessError):
    """The request is for a host that this service does not answer for."""


class OriginError(AccessError):
    """The request comes from a web page of somewhere else."""


class UnauthenticatedError(AccessError):
    """The request has no key, or one that does not hold."""


class ForbiddenError(AccessError):
    """The key does not have the scope that the request needs."""


class StoreLockedError(ServiceError):
    """Another program holds the job store's database, and did not let go of it in time."""


class NotFoundError(ServiceError):
    """There is no such resource; carries ``kind`` and ``id``. why: what may have become of it."""

    def __init__(self, kind: str, id: str, why: str = "") -> None:
        super().__init__(f"There is no {kind} {id[:80]!r}{f'; {why}' if why else ''}.")
        self.kind = kind
        self.id = id[:80]


class StoppingError(ServiceError):
    """The service ends; what it has taken in goes on after its next start."""


class GoneError(ServiceError):
    """The resource was there and is over: it was deleted, or nobody used it for too long."""


class NotReadyError(ServiceError):
    """The job has no result to give."""


class DemUnderWayError(ServiceError):
    """The DEM is not there yet: it is being made."""


class InUseError(ServiceError):
    """The resource is needed by jobs that are not finished."""


class EditConflictError(ServiceError):
    """Somebody else saved since; carries ``version`` (the newest), ``saved_by`` and ``saved_at`` (ISO 8601, UTC)."""

    def __init__(self, message: str, *, version: int, saved_by: str, saved_at: str) -> None:
        super().__init__(message)
        self.version = version
        self.saved_by = saved_by
        self.saved_at = saved_at


class NoPreconditionError(ServiceError):
    """A change has to say which version it builds on, so that nobody's work is lost."""


class RequestError(ServiceError):
    """The request makes no sense."""


class NotJsonError(RequestError):
    """The body is not JSON."""


class NotValidError(RequestError):
    """The body's fields are not as they should be; carries ``errors``: what is wrong with which of them."""

    def __init__(self, message: str, errors: Sequence[Mapping[str, str]] = ()) -> None:
        super().__init__(message)
        self.errors = tuple(errors)


class MediaTypeError(RequestError):
    """The body has a type that is not understood."""


class RangeError(RequestError):
    """The Range header asks for bytes that the file does not have, or is not understood."""


class TooSlowError(RequestError):
    """The body came too slowly."""


class LimitError(RequestError):
    """The request is beyond a limit of the settings; carries ``limit_name``, ``limit`` and ``given``."""

    def __init__(self, message: str, *, limit_name: str, limit: float, given: float | None = None) -> None:
        super().__init__(f"{message} (setting SIGHTLINE_{limit_name.upper()}).")
        self.limit_name = limit_name
        self.limit = limit
        self.given = given


class BodyTooLargeError(LimitError):
    """The body has more bytes than allowed."""


class TooManyError(LimitError):
    """The client has as many of these as it may; one has to end before another can begin."""


class BusyError(LimitError):
    """Too many requests of this kind wait already; carries ``retry_after_s``."""

    retry_after_s = 5


class JobError(ServiceError):
    """A job could not be finished."""


class TimeLimitError(JobError):
    """The job ran longer than allowed."""


class MemoryLimitError(JobError):
    """The job needed more memory than allowed."""


class StorageFullError(JobError):
    """There is no space left to write to."""


class ClusterSetUpError(JobError):
    """A machine of the cluster lacks the data folder, or has another Sightline."""


class JobInterruptedError(JobError):
    """The job's worker died more often than it is tried again."""


class JobCancelledError(JobError):
    """The job was cancelled."""


class InternalError(JobError):
    """A fault of ours; the log tells more under ``reference``."""

    def __init__(self, reference: str) -> None:
        super().__init__(f"An internal error occurred; the service's log tells more under {reference}.")
        self.reference = reference
