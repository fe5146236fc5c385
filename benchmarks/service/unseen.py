"""The service without request ids, log lines of requests and metrics, to tell what these cost: ``seen_and_unseen``."""

from __future__ import annotations

import sys

from starlette.types import Receive, Scope, Send

from service.cli import main
from service.http.seeing.requests import Seen


async def _passed_on(self: Seen, scope: Scope, receive: Receive, send: Send) -> None:
    await self._app(scope, receive, send)


if __name__ == "__main__":
    Seen.__call__ = _passed_on  # type: ignore[method-assign] # that is what this program is for
    sys.argv = ["sightline", "serve"]
    main()
