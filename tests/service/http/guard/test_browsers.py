"""Web pages of elsewhere cannot use somebody's service, and programs see no difference."""

from __future__ import annotations

from collections.abc import Iterator
from http.client import HTTPConnection

import httpx
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from service.live.request import ANCHORS
from tests.service.running import Server, running

NOT_OURS = [
    "evil.example",
    "evil.example:80",
    "localhost.evil.example",
    "127.0.0.1.evil.example",
    "[::1].evil",
    "",
    "a b",
]
OURS = ["localhost", "localhost:8000", "LOCALHOST.", "planner.localhost", "127.0.0.1", "[::1]:8000", "192.0.2.7:80"]


@pytest.mark.parametrize("host", NOT_OURS)
def test_a_name_that_is_pointed_at_us_is_refused(server: Server, host: str) -> None:
    """As DNS rebinding does it: the page's own name, our address."""
    for method, path in (("GET", "/dems"), ("GET", "/"), ("POST", "/dems?sample=valley"), ("GET", "/openapi.json")):
        answer = server.client.request(method, path, headers={"Host": host})
        assert answer.status_code == 421, (host, path)
        assert answer.json()["type"] == "/problems/host"


@pytest.mark.parametrize("host", OURS)
def test_our_own_names_are_ours(server: Server, host: str) -> None:
    assert server.client.get("/dems", headers={"Host": host}).status_code == 200


FOREIGN = [
    {"Origin": "http://evil.example"},
    {"Origin": "null"},
    {"Origin": "http://127.0.0.1:1"},
    {"Origin": "file://"},
    {"Sec-Fetch-Site": "cross-site"},
    {"Sec-Fetch-Site": "same-site", "Sec-Fetch-Mode": "no-cors"},
    {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"},  # a form that sends itself
]


@pytest.mark.parametrize("headers", FOREIGN, ids=str)
@pytest.mark.parametrize("request_line", ["POST /dems?sample=valley", "POST /lines-of-sight", "DELETE /dems/1"])
def test_a_page_elsewhere_changes_nothing(server: Server, headers: dict[str, str], request_line: str) -> None:
    method, _, path = request_line.partition(" ")
    answer = server.client.request(method, path, headers=headers, content=b"{}" if method == "POST" else None)
    assert (answer.status_code, answer.json()["type"]) == (403, "/problems/origin")


@pytest.mark.parametrize(
    ("name", "values", "status"),
    [
        ("Origin", ("http://127.0.0.1", "http://evil.example"), 403),
        ("Content-Type", ("application/json", "text/plain"), 415),
    ],
)
def test_a_header_that_decides_is_there_once(server: Server, name: str, values: tuple[str, str], status: int) -> None:
    """Of two another program may go by the other one."""
    for order in (values, values[::-1], values[:1] * 2):
        headers = [(name, value) for value in order]
        answer = server.client.post("/lines-of-sight", headers=headers, content=b"{}")
        assert answer.status_code == status, (order, answer.text)
        assert "2 times; send it once" in answer.json()["detail"]


def test_two_hosts_are_no_request_at_all(server: Server) -> None:
    url = httpx.URL(server.url)
    connection = HTTPConnection(url.host, url.port, timeout=30.0)
    connection.putrequest("GET", "/dems", skip_host=True)
    connection.putheader("Host", "localhost")
    connection.putheader("Host", "evil.example")
    connection.endheaders()
    assert connection.getresponse().status == 400
    connection.close()


def test_a_page_elsewhere_cannot_have_things_fetched_but_may_link_to_us(server: Server) -> None:
    picture = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert server.client.get("/dems", headers=picture).status_code == 403
    assert server.client.get("/", headers=link).status_code == 200


def test_our_own_page_changes_what_it_likes(server: Server) -> None:
    own = {"Origin": server.url, "Sec-Fetch-Site": "same-origin"}
    assert server.client.post("/dems?sample=valley", headers=own).status_code in (200, 201)


def test_a_page_must_say_what_it_sends(server: Server) -> None:
    untyped = server.client.post("/dems", headers={"Origin": server.url}, content=b"x")
    assert untyped.status_code == 415
    assert untyped.json()["detail"] == "The body must say what it is, with the header 'Content-Type'."


def test_a_page_elsewhere_opens_no_stream(server: Server) -> None:
    stream = server.client.post("/detectors", json={"anchors": ANCHORS}).json()["links"]["stream"]
    url = f"{server.url.replace('http', 'ws', 1)}{stream}"
    with pytest.raises(InvalidStatus) as refused:
        connect(url, proxy=None, origin="http://evil.example")  # type: ignore[arg-type] # a NewType of str
    assert refused.value.response.status_code == 403
    with connect(url, proxy=None, origin=server.url) as own:  # type: ignore[arg-type] # an origin is any text
        own.ping()


@pytest.mark.parametrize("path", ["/dems", "/nothing", "/openapi.json", "/health", "/docs", "/page/index.js"])
def test_every_answer_says_what_may_be_done_with_it(server: Server, path: str) -> None:
    headers = server.client.get(path).headers
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "default-src 'none'" in headers["Content-Security-Policy"]
    assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]
    assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert "Access-Control-Allow-Origin" not in headers


@pytest.fixture(scope="module")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A service that lets the pages of one other origin in, and has a name."""
    folder = tmp_path_factory.mktemp("shared") / "data"
    names = '["planner.example.org", "*.lab.example.org"]'
    with running(folder, allowed_hosts=names, allowed_origins='["https://maps.example.org"]', workers=1) as server:
        yield server


def test_pages_that_the_operator_lets_in_get_in(shared: Server) -> None:
    own = {"Origin": "https://maps.example.org", "Sec-Fetch-Site": "cross-site"}
    preflight = {**own, "Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "content-type"}
    allowed = shared.client.options("/dems", headers=preflight)
    assert allowed.status_code == 200
    assert allowed.headers["Access-Control-Allow-Origin"] == "https://maps.example.org"
    posted = shared.client.post("/dems?sample=valley", headers=own)
    assert posted.status_code == 201
    assert posted.headers["Access-Control-Allow-Origin"] == "https://maps.example.org"
    other = {**preflight, "Origin": "https://evil.example"}
    assert "Access-Control-Allow-Origin" not in shared.client.options("/dems", headers=other).headers
    assert shared.client.post("/dems?sample=valley", headers={"Origin": "https://evil.example"}).status_code == 403


@pytest.mark.parametrize(
    ("host", "status"),
    [("planner.example.org", 200), ("a.lab.example.org:8443", 200), ("lab.example.org", 421), ("example.org", 421)],
)
def test_names_of_the_settings_are_ours(shared: Server, host: str, status: int) -> None:
    assert httpx.get(f"{shared.url}/dems", headers={"Host": host}, trust_env=False).status_code == status
