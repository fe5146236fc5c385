"""Keys are shown once, kept as hashes, hold until they expire or are revoked, and nothing of them leaks."""

from __future__ import annotations

import json
import stat
import threading
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from service.access import keys as module
from service.access.callers import Scope
from service.access.gate import Gate
from service.access.keys import KeyRing, add_key, read_keys, revoke_key
from service.access.logins import MOST_OF_ONE_KEY, Logins
from service.errors import KeysError, NotFoundError, RequestError
from service.settings import Settings

CALCULATE = (Scope.CALCULATE,)


@pytest.fixture
def path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(module, "LOOK_EVERY_S", 0.0)
    return tmp_path / "keys.json"


def test_a_key_is_found_by_its_text_and_by_no_other(path: Path) -> None:
    key, text = add_key(path, "rover 7", "alpha", CALCULATE)
    _, other = add_key(path, "rover 8", "beta", (Scope.READ,))
    ring = KeyRing(path)
    assert ring.find(text) == key
    assert key.caller().tenant == "alpha"
    found = ring.find(other)
    assert found is not None
    assert found.tenant == "beta"
    swapped = text[: len("sightline_") + 12] + other[len("sightline_") + 12 :]
    for wrong in ("", "x", text[:-1], f"{text} ", text.upper(), swapped, key.sha256, "sightline_" + "0" * 56, "\ud800"):
        assert ring.find(wrong) is None, wrong


def test_the_file_is_its_owners_alone_and_holds_no_secret(path: Path) -> None:
    _, text = add_key(path, "rover", "alpha", CALCULATE)
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert text.rpartition("_")[2] not in path.read_text(encoding="utf-8")
    assert [one.name for one in path.parent.iterdir()] == ["keys.json"]


def test_no_two_keys_are_alike_also_when_many_are_made_at_once(path: Path) -> None:
    makers = [threading.Thread(target=add_key, args=(path, f"k{n}", "alpha", CALCULATE)) for n in range(20)]
    for maker in makers:
        maker.start()
    for maker in makers:
        maker.join()
    assert len({key.id for key in read_keys(path)}) == 20


def test_a_service_that_runs_takes_note_of_keys_that_come_and_go(path: Path) -> None:
    ring = KeyRing(path)
    assert len(ring) == 0
    key, text = add_key(path, "rover", "alpha", CALCULATE)
    assert ring.find(text) == key
    assert revoke_key(path, key.id) == key
    assert ring.find(text) is None
    with pytest.raises(NotFoundError):
        revoke_key(path, key.id)


def test_a_key_expires(path: Path) -> None:
    begun = datetime(2026, 5, 1, tzinfo=UTC)
    _, text = add_key(path, "guest", "alpha", CALCULATE, begun + timedelta(days=1))
    now_s = begun.timestamp()
    ring = KeyRing(path, lambda: now_s)
    assert ring.find(text) is not None
    now_s += 86_400.0
    assert ring.find(text) is None
    assert len(ring) == 0


def test_a_file_that_makes_no_sense_is_refused_at_the_start_and_later_changes_nothing(path: Path) -> None:
    key, text = add_key(path, "rover", "alpha", CALCULATE)
    ring = KeyRing(path)
    path.write_text('{"keys": [{"id": 1}]}', encoding="utf-8")
    assert ring.find(text) == key
    with pytest.raises(KeysError, match="it is no file of keys"):
        KeyRing(path)
    with pytest.raises(KeysError, match="no file of keys"):
        add_key(path, "another", "alpha", CALCULATE)
    assert json.loads(path.read_text(encoding="utf-8")) == {"keys": [{"id": 1}]}


@pytest.mark.parametrize("tenant", ["", "Alpha", "../x", "a b", "a" * 64, "ä", "-a"])
def test_a_tenant_is_a_plain_word(path: Path, tenant: str) -> None:
    with pytest.raises(RequestError, match="cannot be a tenant"):
        add_key(path, "rover", tenant, CALCULATE)


@pytest.mark.parametrize(
    ("scope", "allowed"),
    [("read", {"read"}), ("calculate", {"read", "calculate"}), ("admin", {"read", "calculate", "admin"})],
)
def test_a_scope_allows_what_stands_before_it(scope: str, allowed: set[str]) -> None:
    assert {str(needed) for needed in Scope if Scope(scope).allows(needed)} == allowed


def test_a_login_lasts_its_time_and_many_push_out_the_oldest_of_the_same_key() -> None:
    now_s = 0.0
    logins = Logins(100.0, lambda: now_s)
    first, others = logins.open("a"), [logins.open("b") for _ in range(MOST_OF_ONE_KEY + 1)]
    assert logins.key_id(first) == "a"
    assert logins.key_id(others[0]) is None
    assert logins.key_id(others[-1]) == "b"
    logins.close(others[-1])
    assert logins.key_id(others[-1]) is None
    now_s = 100.0
    assert logins.key_id(first) is None


def test_off_loopback_there_must_be_keys_or_it_is_said_aloud(path: Path, caplog: pytest.LogCaptureFixture) -> None:
    settings = Settings(keys_file=path)
    for address in ("0.0.0.0", "192.0.2.1", "::", "2001:db8::1"):
        with pytest.raises(KeysError, match="sightline keys add NAME"):
            Gate(settings).check_off_loopback(address, insecure=False)
    for address in ("127.0.0.1", "127.8.8.8", "::1"):
        Gate(settings).check_off_loopback(address, insecure=False)
    assert not caplog.records
    Gate(settings).check_off_loopback("0.0.0.0", insecure=True)
    assert "INSECURE: whoever reaches 0.0.0.0 can read, change and delete everything" in caplog.text
    add_key(path, "rover", "alpha", CALCULATE)
    Gate(settings).check_off_loopback("0.0.0.0", insecure=False)


def test_keys_that_were_demanded_stay_demanded_when_the_last_is_revoked(path: Path) -> None:
    gate = Gate(Settings(keys_file=path))
    assert not gate.demands_keys
    key, _ = add_key(path, "rover", "alpha", CALCULATE)
    assert gate.demands_keys
    revoke_key(path, key.id)
    assert gate.demands_keys
