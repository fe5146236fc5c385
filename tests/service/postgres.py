"""A PostgreSQL server of the tests' own: from Debian's packages, in a folder that is removed, without the network."""

from __future__ import annotations

import os
import pwd
import shutil
import signal
import subprocess
import tempfile
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import psycopg
import pytest

PROGRAMS = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
# it refuses to run as root
NOBODY = "nobody" if os.geteuid() == 0 else None
START_MAY_TAKE_S = 60.0


@dataclass
class PostgresServer:
    """A server that can be stopped, killed and started again on the same data."""

    programs: Path
    folder: Path
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        quick = ("fsync=off", "listen_addresses=", f"unix_socket_directories={self.folder}", "max_connections=20")
        words = [str(self.programs / "postgres"), "-D", str(self.folder / "data")]
        words += [word for setting in quick for word in ("-c", setting)]
        with (self.folder / "log").open("ab") as log:
            self.process = subprocess.Popen(words, user=NOBODY, cwd=self.folder, stdout=log, stderr=log)
        ready = [str(self.programs / "pg_isready"), "--host", str(self.folder), "--timeout", "1"]
        deadline_s = time.monotonic() + START_MAY_TAKE_S
        while subprocess.run(ready, stdout=subprocess.DEVNULL).returncode:
            assert self.process.poll() is None, (self.folder / "log").read_text()
            assert time.monotonic() < deadline_s, (self.folder / "log").read_text()
            time.sleep(0.05)

    def stop(self, how: signal.Signals = signal.SIGINT) -> None:
        """SIGINT ends it with its connections, SIGQUIT at once, without tidying up."""
        assert self.process is not None
        self.process.send_signal(how)
        self.process.wait(30)

    def url(self, database: str) -> str:
        return f"postgresql:///{database}?host={self.folder}&user=sightline"

    def new_database(self) -> str:
        """The address of an empty database."""
        name = f"t{uuid.uuid4().hex[:12]}"
        with psycopg.connect(self.url("postgres"), autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return self.url(name)


@contextmanager
def postgres_server() -> Iterator[PostgresServer]:
    """Skips where there is none: apt-get install postgresql."""
    if not PROGRAMS:
        pytest.skip("no PostgreSQL server is installed (Debian's package postgresql)")
    # a short path, since sockets have no room for a long one, and one that another user can reach
    folder = Path(tempfile.mkdtemp(prefix="sl-pg-", dir="/tmp"))
    try:
        if NOBODY is not None:
            os.chown(folder, pwd.getpwnam(NOBODY).pw_uid, -1)
        server = PostgresServer(PROGRAMS[-1].parent, folder)
        words = ["--pgdata", str(folder / "data"), "--username", "sightline", "--auth", "trust", "--no-sync"]
        made = [str(PROGRAMS[-1]), *words, "--encoding", "UTF8", "--locale", "C.UTF-8"]
        subprocess.run(made, user=NOBODY, cwd=folder, check=True, stdout=subprocess.DEVNULL)
        server.start()
        try:
            yield server
        finally:
            server.stop()
    finally:
        shutil.rmtree(folder)
