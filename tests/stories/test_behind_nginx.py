"""The documented nginx in front: TLS, HTTP/2, compression; ids and addresses of clients are as operators expect."""

from __future__ import annotations

import json
import shutil
import socket
import ssl
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.house.repository import ROOT
from tests.service.running import Server, running
from tests.stories.grounds import short_job

NAME = "sightline.example.org"


def started_nginx(folder: Path, upstream_port: int) -> tuple[subprocess.Popen[bytes], int]:
    nginx, openssl = shutil.which("nginx"), shutil.which("openssl")
    if nginx is None or openssl is None:
        pytest.skip("nginx and openssl are not installed here")
    made = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", f"/CN={NAME}"]
    key, certificate = folder / "key.pem", folder / "cert.pem"
    subprocess.run([openssl, *made, "-keyout", key, "-out", certificate], check=True, capture_output=True)
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = int(free.getsockname()[1])
    temporary = "".join(
        f"{what}_temp_path {folder}/{what};\n" for what in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")
    )
    text = (ROOT / "docs" / "deployment" / "nginx.conf").read_text(encoding="utf-8")
    for documented, here in (
        ("listen 443 ", f"listen 127.0.0.1:{port} "),
        ("127.0.0.1:8000", f"127.0.0.1:{upstream_port}"),
        ("/etc/ssl/sightline/fullchain.pem", str(certificate)),
        ("/etc/ssl/sightline/privkey.pem", str(key)),
        ("http {\n", f"http {{\naccess_log off;\n{temporary}"),
    ):
        assert documented in text
        text = text.replace(documented, here)
    top = f"daemon off;\nmaster_process off;\nuser root;\npid {folder}/nginx.pid;\nerror_log {folder}/error.log;\n"
    (folder / "nginx.conf").write_text(top + text)
    process = subprocess.Popen([nginx, "-p", folder, "-c", folder / "nginx.conf"], stderr=subprocess.DEVNULL)
    deadline_s = time.monotonic() + 10.0
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
            return process, port
        except OSError:
            assert process.poll() is None, (folder / "error.log").read_text()
            assert time.monotonic() < deadline_s
            time.sleep(0.05)


@pytest.fixture(scope="module")
def behind(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Server, int]]:
    folder = tmp_path_factory.mktemp("nginx")
    settings: dict[str, Any] = {"allowed_hosts": json.dumps([NAME]), "log_format": "json", "rehearse": "maps"}
    with running(folder / "data", **settings) as server:
        process, port = started_nginx(folder, int(server.url.rpartition(":")[2]))
        try:
            yield server, port
        finally:
            process.terminate()
            process.wait(10)


def client_of(port: int, address: str = "127.0.0.1") -> httpx.Client:
    # the certificate is one that the test made itself
    transport = httpx.HTTPTransport(verify=False, local_address=address)
    url = f"https://127.0.0.1:{port}"
    return httpx.Client(base_url=url, headers={"Host": NAME}, transport=transport, timeout=120.0, trust_env=False)


def access_line(server: Server, request_id: str) -> dict[str, Any]:
    """What the log says of a request, which it does once the answer is sent."""
    deadline_s = time.monotonic() + 30.0
    while True:
        told = [json.loads(line) for line in server.said]
        mine = [line for line in told if line["logger"] == "sightline.access" and line["request_id"] == request_id]
        if mine:
            (line,) = mine
            return line
        assert time.monotonic() < deadline_s, f"no line of request {request_id}"
        time.sleep(0.05)


def test_a_map_is_asked_and_downloaded_through_the_proxy(behind: tuple[Server, int]) -> None:
    _, port = behind
    with client_of(port) as client:
        dem = client.post("/dems", params={"sample": "valley"})
        assert dem.status_code in (200, 201), dem.text
        made = client.post("/visibility-maps", json=short_job(dem.json()), headers={"Prefer": "wait=60"})
        assert made.status_code == 201
        followed = client.get(made.headers["Location"])
        assert (followed.headers["Content-Encoding"], followed.json()) == ("gzip", made.json())
        layer = client.get(made.json()["layers"][0]["href"])
        assert layer.status_code == 200
        assert layer.content[:2] in (b"II", b"MM")
        again = client.get(made.json()["layers"][0]["href"], headers={"If-None-Match": layer.headers["ETag"]})
        assert again.status_code == 304
        part = client.get(made.json()["layers"][0]["href"], headers={"Range": "bytes=0-1"})
        assert (part.status_code, part.content) == (206, layer.content[:2])


def test_the_log_has_the_client_and_the_id_of_the_proxy(behind: tuple[Server, int]) -> None:
    server, port = behind
    with client_of(port, "127.0.0.9") as client:
        forged = {"X-Forwarded-For": "203.0.113.7", "X-Request-Id": "mine"}
        told = client.get("/dems", headers=forged).headers["X-Request-Id"]
    assert told != "mine"
    assert access_line(server, told)["client"] == "127.0.0.9"


def test_who_is_no_proxy_is_not_believed(behind: tuple[Server, int]) -> None:
    server, _ = behind
    transport = httpx.HTTPTransport(local_address="127.0.0.8")
    with httpx.Client(base_url=server.url, transport=transport, trust_env=False) as client:
        told = client.get("/dems", headers={"X-Forwarded-For": "203.0.113.7"}).headers["X-Request-Id"]
    assert access_line(server, told)["client"] == "127.0.0.8"


def test_browsers_speak_http_2_with_it(behind: tuple[Server, int]) -> None:
    _, port = behind
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    context.set_alpn_protocols(["h2", "http/1.1"])
    with socket.create_connection(("127.0.0.1", port)) as plain, context.wrap_socket(plain) as spoken:
        assert spoken.selected_alpn_protocol() == "h2"
