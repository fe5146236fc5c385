"""Tokens of an identity provider: an issuer made here signs them, and whatever is wrong with one is refused."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import hmac
import json
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, rsa

from service.access.callers import Caller, Scope
from service.access.tokens import Tokens
from service.errors import ForbiddenError, KeysError, UnauthenticatedError
from service.settings import Settings

ISSUER = "https://login.example.org"
RSA = rsa.generate_private_key(public_exponent=65537, key_size=2048)
EC = ec.generate_private_key(ec.SECP256R1())
OTHERS = rsa.generate_private_key(public_exponent=65537, key_size=2048)


def jwks() -> dict[str, Any]:
    of_rsa = json.loads(jwt.algorithms.RSAAlgorithm.to_jwk(RSA.public_key()))
    of_ec = json.loads(jwt.algorithms.ECAlgorithm.to_jwk(EC.public_key()))
    return {"keys": [{**of_rsa, "kid": "r", "alg": "RS256"}, {**of_ec, "kid": "e", "alg": "ES256"}]}


def claims(**more: Any) -> dict[str, Any]:
    now_s = int(time.time())
    told = {"iss": ISSUER, "aud": "sightline", "sub": "ada", "exp": now_s + 300, "tenant": "alpha"}
    return {key: value for key, value in {**told, "scope": "openid sightline:calculate", **more}.items() if value != ""}


def signed(key: Any = RSA, algorithm: str = "RS256", kid: str = "r", **more: Any) -> str:
    return jwt.encode(claims(**more), key, algorithm, headers={"kid": kid})


@pytest.fixture
def tokens(tmp_path: Path) -> Tokens:
    place = tmp_path / "jwks.json"
    place.write_text(json.dumps(jwks()), encoding="utf-8")
    return Tokens(Settings(oidc_issuer=ISSUER, oidc_audience="sightline", oidc_jwks=str(place)))


def test_a_token_says_who_comes_and_what_it_may_do(tokens: Tokens) -> None:
    expected = Caller("alpha", "ada", (Scope.CALCULATE,))
    assert asyncio.run(tokens.caller(signed())) == expected
    assert asyncio.run(tokens.caller(signed(EC, "ES256", "e"))) == expected
    listed = signed(scope="", scp=["sightline:read", "admin"])
    assert asyncio.run(tokens.caller(listed)).scopes == (Scope.READ,)


PUBLIC = RSA.public_key().public_bytes(serialization.Encoding.PEM, serialization.PublicFormat.SubjectPublicKeyInfo)


def hashed_with_the_public_key() -> str:
    """The classic: signed with HMAC and the public key as its secret. PyJWT itself refuses to make it."""

    def part(value: dict[str, Any]) -> bytes:
        return base64.urlsafe_b64encode(json.dumps(value).encode()).rstrip(b"=")

    body = part({"alg": "HS256", "typ": "JWT", "kid": "r"}) + b"." + part(claims())
    mac = base64.urlsafe_b64encode(hmac.new(PUBLIC, body, hashlib.sha256).digest()).rstrip(b"=")
    return (body + b"." + mac).decode()


BAD = {
    "another's signature": lambda: signed(OTHERS),
    "a kid that nobody has": lambda: signed(kid="x"),
    "a kid of another kind of key": lambda: signed(kid="e"),
    "no signature": lambda: jwt.encode(claims(), None, "none", headers={"kid": "r"}),
    "the public key as a secret": hashed_with_the_public_key,
    "expired": lambda: signed(exp=int(time.time()) - 60),
    "without an end": lambda: signed(exp=""),
    "not yet": lambda: signed(nbf=int(time.time()) + 300),
    "another issuer": lambda: signed(iss="https://evil.example"),
    "another audience": lambda: signed(aud="other"),
    "nobody": lambda: signed(sub=""),
    "no token": lambda: "a.b.c",
}


@pytest.mark.parametrize("what", BAD)
def test_a_token_that_does_not_hold_is_refused(tokens: Tokens, what: str) -> None:
    with pytest.raises(UnauthenticatedError, match="The token does not hold"):
        asyncio.run(tokens.caller(BAD[what]()))


@pytest.mark.parametrize("tenant", ["", "Alpha", "../beta", 7, ["alpha"]], ids=str)
def test_a_token_without_a_tenant_reaches_nothing(tokens: Tokens, tenant: Any) -> None:
    with pytest.raises(ForbiddenError, match="names a tenant"):
        asyncio.run(tokens.caller(signed(tenant=tenant)))


@pytest.mark.parametrize("missing", ["oidc_issuer", "oidc_audience"])
def test_settings_that_do_not_suffice_are_refused(missing: str) -> None:
    given = {"oidc_issuer": ISSUER, "oidc_audience": "sightline"}
    with pytest.raises(KeysError, match="both"):
        Tokens(Settings(**{**given, missing: None}))


@pytest.fixture
def issuer() -> Iterator[tuple[str, list[str]]]:
    """An identity provider on loopback, and what it was asked."""
    asked: list[str] = []

    class Provider(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(self.path)
            url = f"http://127.0.0.1:{server.server_port}"
            documents = {"/.well-known/openid-configuration": {"jwks_uri": f"{url}/keys"}, "/keys": jwks()}
            body = json.dumps(documents[self.path]).encode()
            self.send_response(200)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *words: Any) -> None:
            """Says nothing."""

    server = HTTPServer(("127.0.0.1", 0), Provider)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}", asked
    server.shutdown()
    thread.join()
    server.server_close()


def test_the_issuer_is_asked_for_its_keys_once_also_when_strangers_name_others(issuer: tuple[str, list[str]]) -> None:
    url, asked = issuer
    tokens = Tokens(Settings(oidc_issuer=url, oidc_audience="sightline"))

    async def ask() -> None:
        assert (await tokens.caller(signed(iss=url))).tenant == "alpha"
        for n in range(50):
            with pytest.raises(UnauthenticatedError):
                await tokens.caller(signed(iss=url, kid=f"x{n}"))

    asyncio.run(ask())
    assert asked == ["/.well-known/openid-configuration", "/keys"]


def test_an_issuer_that_cannot_be_reached_is_said_to_be(tmp_path: Path) -> None:
    tokens = Tokens(Settings(oidc_issuer=ISSUER, oidc_audience="sightline", oidc_jwks=str(tmp_path / "none.json")))
    with pytest.raises(KeysError, match="cannot be read, so no token can be checked"):
        asyncio.run(tokens.caller(signed()))
