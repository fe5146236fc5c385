"""Logging in and out of the page: a key is shown once, and a cookie stands for it from then on."""

from __future__ import annotations

import base64
import hashlib
from html import escape

from fastapi import APIRouter, Request, Response
from starlette.responses import HTMLResponse, RedirectResponse

from service.access.callers import rooted
from service.access.gate import Gate, cookie_in
from service.access.logins import COOKIE
from service.errors import AccessError, UnauthenticatedError

__all__ = ["router"]

router = APIRouter(include_in_schema=False)
STYLE = (
    "body{font:16px/1.5 system-ui,sans-serif;margin:0;display:grid;place-items:center;min-height:100vh;"
    "background:#12161c;color:#e8ecf1}main{width:min(24rem,90vw)}input,button{font:inherit;width:100%;"
    "box-sizing:border-box;padding:.6rem .8rem;border-radius:.4rem;border:1px solid #5a6675;margin:.3rem 0 1rem}"
    "button{background:#2f6fde;color:#fff;border:0;cursor:pointer}p[role=alert]{color:#ffb4a8}"
)
POLICY = (
    f"default-src 'none'; style-src 'sha256-{base64.b64encode(hashlib.sha256(STYLE.encode()).digest()).decode()}'; "
    "form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
# a form's Origin is withheld under the policy of all other answers, and Origin is what tells whose the form is
HEADERS = {"Content-Security-Policy": POLICY, "Referrer-Policy": "same-origin", "Cache-Control": "no-store"}
PAGE = """<!doctype html>
<html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>Log in to Sightline</title><style>{style}</style>
<main><h1>Sightline</h1><form method="post" action="{action}">{told}
<label for="key">Your key</label>
<input id="key" name="key" type="password" autocomplete="current-password" required autofocus>
<button>Log in</button></form></main></html>
"""


@router.get("/login")
async def show_login(request: Request) -> Response:
    """The form; where no keys are demanded, the planner."""
    gate: Gate = request.app.state.gate
    return _page() if gate.demands_keys else RedirectResponse("/", 303)


@router.post("/login")
async def log_in(request: Request) -> Response:
    """A cookie for the key, and on to the planner."""
    gate: Gate = request.app.state.gate
    async with request.form(max_files=0, max_fields=1) as form:
        text = str(form.get("key", "")).strip()
    try:
        caller = await gate.caller_with(text)
        if not caller.key_id:
            raise UnauthenticatedError("Tokens go into the header Authorization; log in with a key.")
    except AccessError as error:
        return _page(str(error), 401)
    answer = RedirectResponse("/", 303, {"Cache-Control": "no-store"})
    answer.set_cookie(
        COOKIE,
        gate.logins.open(caller.key_id),
        max_age=int(gate.logins.lasts_s),
        path=rooted("/"),
        httponly=True,
        samesite="strict",
        secure=request.url.scheme == "https",
    )
    return answer


@router.post("/logout")
async def log_out(request: Request) -> Response:
    """The cookie stands for nothing any more."""
    gate: Gate = request.app.state.gate
    gate.logins.close(cookie_in(request.headers))
    answer = RedirectResponse("/login", 303)
    answer.delete_cookie(COOKIE, rooted("/"), httponly=True, samesite="strict")
    return answer


def _page(told: str = "", status: int = 200) -> Response:
    alert = f'<p role="alert">{escape(told)}</p>' if told else ""
    return HTMLResponse(PAGE.format(style=STYLE, told=alert, action=rooted("/login")), status, HEADERS)
