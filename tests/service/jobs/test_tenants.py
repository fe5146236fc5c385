"""What a tenant sees of the store, and what it may take of the service."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from service.access.callers import CALLER, LOCAL, Caller, Scope
from service.database import Database
from service.errors import InUseError, NotFoundError, StorageFullError, TooManyError
from service.jobs.records import DemRecord, JobRecord, JobStatus
from service.jobs.sharing.quotas import Quotas
from service.jobs.store import Store
from service.missions.shelf import MissionShelf, Sheet
from service.settings import Settings

MAPS = "visibility-map"


@contextmanager
def acting(tenant: str) -> Iterator[None]:
    token = CALLER.set(Caller(tenant, "test", (Scope.CALCULATE,), "0" * 12))
    try:
        yield
    finally:
        CALLER.reset(token)


@pytest.fixture
def store(opened: Callable[[], Database]) -> Iterator[Store]:
    store = Store(opened())
    for tenant in ("alpha", "beta"):
        store.add_dem(DemRecord(f"dem-{tenant}", "hill.tif", 1.0, {"sha256": "s", "cells": 250_000}, tenant))
        store.add_job(JobRecord(f"job-{tenant}", MAPS, f"dem-{tenant}", {}, JobStatus.QUEUED, 1.0, tenant=tenant))
    yield store
    store.close()


def test_a_tenant_sees_its_own_and_what_is_not_its_own_is_not_there(store: Store) -> None:
    with acting("alpha"):
        assert store.dem("dem-alpha").tenant == "alpha"
        assert ([dem.id for dem in store.dems(10, 0)[0]], store.dems(10, 0)[1]) == (["dem-alpha"], 1)
        assert ([job.id for job in store.jobs(MAPS, 10, 0)[0]], store.jobs(MAPS, 10, 0)[1]) == (["job-alpha"], 1)
        for look in (lambda: store.dem("dem-beta"), lambda: store.remove_dem("dem-beta")):
            with pytest.raises(NotFoundError) as told:
                look()
            with pytest.raises(NotFoundError) as nothing:
                store.dem("dem-none")
            assert str(told.value).replace("beta", "none") == str(nothing.value)
        with pytest.raises(NotFoundError):
            store.job(MAPS, "job-beta")
        with pytest.raises(InUseError, match="1 job "):
            store.remove_dem("dem-alpha")
    assert len(store.dems(10, 0)[0]) == 2
    assert len(store.active_jobs()) == 2


def test_a_job_cannot_be_put_on_the_ground_of_another(store: Store) -> None:
    with pytest.raises(NotFoundError):
        store.add_job(JobRecord("x", MAPS, "dem-beta", {}, JobStatus.QUEUED, 1.0, tenant="alpha"))


def test_the_same_content_has_another_id_for_each_tenant_and_the_same_for_one(store: Store) -> None:
    content = "0123456789abcdef" * 2
    ids = {}
    for tenant in ("alpha", "beta", "alpha", "default"):
        with acting(tenant):
            ids.setdefault(tenant, set()).add(store.own_id(content))
    assert all(len(own) == 1 for own in ids.values())
    assert len(set.union(*ids.values())) == 3
    # what was there before there were tenants keeps its ids
    assert ids["default"] == {content}


def test_missions_are_their_tenants_and_stand_on_its_ground(store: Store) -> None:
    shelf = MissionShelf(store.transaction, 1, 10)
    made = {}
    for tenant in ("alpha", "beta"):
        with acting(tenant):  # one each may be kept
            made[tenant] = shelf.add(Sheet("{}", "survey", 2, "s"), None)
            assert made[tenant].dem_id == f"dem-{tenant}"
    with acting("alpha"):
        assert [one.id for one in shelf.missions(10, 0)[0]] == [made["alpha"].id]
        other = made["beta"].id
        for look in (shelf.mission, shelf.document, shelf.remove, lambda id: shelf.versions(id, 1, 0)):
            with pytest.raises(NotFoundError):
                look(other)


def test_seconds_are_counted_also_of_jobs_that_were_deleted(store: Store) -> None:
    quotas = Quotas(Settings(max_tenant_calculation_s_per_hour=0.001), store)
    with acting("alpha"):
        quotas.refuse_work()
        store.start_job("job-alpha")
        with store.transaction() as connection:
            connection.execute("UPDATE jobs SET started_at_s = started_at_s - 2.0 WHERE id = 'job-alpha'")
        store.finish_job("job-alpha", JobStatus.CANCELLED)
        store.remove_job("job-alpha")
        with pytest.raises(TooManyError, match="This tenant has used 2 s of calculation in this hour"):
            quotas.refuse_work()
    with acting("beta"):
        quotas.refuse_work()


def test_storage_is_the_tenants_own(store: Store) -> None:
    quotas = Quotas(Settings(max_tenant_storage_bytes=1_000_000), store)
    with acting("alpha"), pytest.raises(StorageFullError, match="take 1 MB, and 1 MB is the limit"):
        quotas.refuse_storage()
    with acting("gamma"):
        quotas.refuse_storage()


def test_places_in_the_queue_are_limited_where_keys_are_demanded(store: Store) -> None:
    quotas = Quotas(Settings(max_tenant_queued_jobs=2), store)
    with acting("alpha"):
        quotas.refuse_waiting(1, "jobs")
        with pytest.raises(TooManyError, match="2 jobs of this tenant wait or run already"):
            quotas.refuse_waiting(2, "jobs")
    token = CALLER.set(Caller(LOCAL.tenant, LOCAL.name, LOCAL.scopes, address="127.0.0.1"))
    quotas.refuse_waiting(255, "jobs")
    CALLER.reset(token)
