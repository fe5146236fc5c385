"""Bearer tokens of an identity provider (OpenID Connect): JSON Web Tokens, checked by PyJWT with its keys."""

from __future__ import annotations

import asyncio
import json
import logging
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import cast

import httpx
import jwt

from service.errors import ForbiddenError, KeysError, UnauthenticatedError
from service.settings import Settings

from .callers import TENANT, Caller, Scope

__all__ = ["Tokens"]

logger = logging.getLogger("sightline.access")

# only what is signed with a key that the provider keeps to itself
ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512", "EdDSA")
PREFIX = "sightline:"
LEEWAY_S = 30.0
# keys change now and then; strangers who name unknown ones must not make us ask for them again and again
KEYS_HOLD_S = 3600.0
ASK_AGAIN_AFTER_S = 30.0
ANSWER_MAY_TAKE_S = 5.0
MOST_BYTES = 1024 * 1024


class Tokens:
    """Checks tokens of one issuer. Raises KeysError where the settings do not suffice."""

    def __init__(self, settings: Settings) -> None:
        if settings.oidc_issuer is None or settings.oidc_audience is None:
            raise KeysError("Tokens need SIGHTLINE_OIDC_ISSUER and SIGHTLINE_OIDC_AUDIENCE both.")
        self._issuer, self._audience = settings.oidc_issuer, settings.oidc_audience
        self._place = settings.oidc_jwks
        self._tenant_claim = settings.oidc_tenant_claim
        self._keys: Mapping[str, jwt.PyJWK] = {}
        self._read_s = float("-inf")
        self._failure: KeysError | None = None
        self._reading = asyncio.Lock()

    async def caller(self, token: str) -> Caller:
        """Whoever comes with the token. Raises UnauthenticatedError, ForbiddenError, KeysError."""
        try:
            kid = jwt.get_unverified_header(token).get("kid", "")
            key = await self._key(str(kid))
            claims = jwt.decode(
                token,
                key,
                algorithms=ALGORITHMS,
                audience=self._audience,
                issuer=self._issuer,
                leeway=LEEWAY_S,
                options={"require": ["exp", "iss", "aud", "sub"]},
            )
        except jwt.InvalidTokenError as error:
            raise UnauthenticatedError(f"The token does not hold: {error}.") from error
        tenant = claims.get(self._tenant_claim)
        if not isinstance(tenant, str) or not TENANT.fullmatch(tenant):
            raise ForbiddenError(
                f"The token has no claim {self._tenant_claim!r} that names a tenant (small letters, digits, dots, "
                "hyphens)."
            )
        return Caller(tenant, str(claims["sub"])[:120], _scopes(claims))

    async def _key(self, kid: str) -> jwt.PyJWK:
        for longest_s in (KEYS_HOLD_S, ASK_AGAIN_AFTER_S):
            async with self._reading:
                if time.monotonic() - self._read_s > longest_s:
                    self._read_s = time.monotonic()
                    await self._read_again()
            if kid in self._keys:
                return self._keys[kid]
        if self._failure is not None:
            raise self._failure
        raise jwt.InvalidTokenError("no key of the issuer has its kid")

    async def _read_again(self) -> None:
        try:
            self._keys, self._failure = await asyncio.to_thread(self._read), None
        except KeysError as error:
            logger.error("%s", error)
            self._failure = error

    def _read(self) -> Mapping[str, jwt.PyJWK]:
        """The issuer's keys by kid."""
        try:
            place = self._place
            if place is None:
                configuration = _fetched(f"{self._issuer.rstrip('/')}/.well-known/openid-configuration")
                place = str(json.loads(configuration)["jwks_uri"])
            text = _fetched(place) if place.startswith(("http://", "https://")) else Path(place).read_bytes()
            found = jwt.PyJWKSet.from_json(text.decode())
        except (OSError, ValueError, KeyError, TypeError, httpx.HTTPError, jwt.PyJWTError) as error:
            raise KeysError(
                f"The keys of {self._issuer} cannot be read, so no token can be checked ({error})."
            ) from error
        return {str(key.key_id or ""): key for key in found.keys}


def _fetched(url: str) -> bytes:
    with httpx.stream("GET", url, timeout=ANSWER_MAY_TAKE_S) as answer:
        answer.raise_for_status()
        body = b""
        for block in answer.iter_bytes():
            body += block
            if len(body) > MOST_BYTES:
                raise ValueError(f"the answer of {url} is longer than {MOST_BYTES:,} bytes")
    return body


def _scopes(claims: Mapping[str, object]) -> tuple[Scope, ...]:
    """What the token allows: ``sightline:read`` and so on, in ``scope`` (words) or ``scp`` (words or a list)."""
    said: list[str] = []
    for claim in ("scope", "scp"):
        value = claims.get(claim, ())
        said += value.split() if isinstance(value, str) else [str(one) for one in cast(Sequence[object], value)]
    return tuple(scope for scope in Scope if f"{PREFIX}{scope}" in said)
