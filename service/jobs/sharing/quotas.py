"""What one tenant may take: places in queues, seconds of calculation, storage. Without keys there are no quotas."""

from __future__ import annotations

from service.access.callers import CALLER, Caller
from service.errors import BusyError, StorageFullError, TooManyError
from service.settings import Settings

from ..store import Store
from .tenants import kept_bytes, spent_s

__all__ = ["Quotas"]


class Quotas:
    """Refuses what is beyond them before work begins; what they tell is of the tenant itself alone."""

    def __init__(self, settings: Settings, store: Store) -> None:
        self._settings = settings
        self._store = store

    def refuse_when_busy(self, waiting: int, what: str) -> None:
        """Raises BusyError when so many of all tenants together wait already."""
        if waiting >= self._settings.max_queued_jobs:
            raise BusyError(
                f"{waiting} {what} wait already, which is the limit; try again in a moment",
                limit_name="max_queued_jobs",
                limit=self._settings.max_queued_jobs,
                given=waiting + 1,
            )

    def refuse_waiting(self, waiting: int, what: str) -> None:
        """Raises TooManyError when so many of the acting tenant's wait already."""
        most = self._settings.max_tenant_queued_jobs
        if _who() is not None and waiting >= most:
            raise TooManyError(
                f"{waiting} {what} of this tenant wait or run already, which is the limit; wait for one, or cancel one",
                limit_name="max_tenant_queued_jobs",
                limit=most,
                given=waiting + 1,
            )

    def refuse_work(self) -> None:
        """In the store thread. Raises TooManyError, StorageFullError when seconds or storage are used up."""
        who, most_s = _who(), self._settings.max_tenant_calculation_s_per_hour
        if who is None:
            return
        if most_s is not None:
            with self._store.transaction("BEGIN") as connection:
                used_s = spent_s(connection, who.tenant)
            if used_s >= most_s:
                raise TooManyError(
                    f"This tenant has used {used_s:,.0f} s of calculation in this hour, which is the limit; it may go "
                    "on in the next",
                    limit_name="max_tenant_calculation_s_per_hour",
                    limit=most_s,
                    given=used_s,
                )
        self.refuse_storage()

    def refuse_storage(self) -> None:
        """In the store thread. Raises StorageFullError when the acting tenant keeps as much as it may."""
        who, most_bytes = _who(), self._settings.max_tenant_storage_bytes
        if who is not None and most_bytes is not None:
            with self._store.transaction("BEGIN") as connection:
                bytes_now = kept_bytes(connection, who.tenant)
            if bytes_now >= most_bytes:
                raise StorageFullError(
                    f"DEMs and results of this tenant take {bytes_now / 1e6:,.0f} MB, and {most_bytes / 1e6:,.0f} MB "
                    "is the limit (setting SIGHTLINE_MAX_TENANT_STORAGE_BYTES); delete some."
                )


def _who() -> Caller | None:
    """Whoever has quotas."""
    caller = CALLER.get()
    return None if caller is None or caller.address else caller
