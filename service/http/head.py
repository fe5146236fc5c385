"""HEAD wherever GET is: the same answer, whose body the server leaves out."""

from __future__ import annotations

from fastapi import APIRouter
from fastapi.routing import APIRoute

__all__ = ["allow_head"]


def allow_head(router: APIRouter) -> None:
    """Answer HEAD on every route of the router that answers GET; the documentation stays as it is."""
    routes = [route for route in router.routes if isinstance(route, APIRoute)]
    # routers outlive the app that they are part of, and serve the next one too
    done = {route.path for route in routes if "HEAD" in (route.methods or ())}
    for route in routes:
        if "GET" not in (route.methods or ()) or route.path in done:
            continue
        router.add_api_route(
            route.path.removeprefix(router.prefix),
            route.endpoint,
            methods=["HEAD"],
            name=f"head_{route.name}",
            response_model=route.response_model,
            response_class=route.response_class,
            include_in_schema=False,
        )
