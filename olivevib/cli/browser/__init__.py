"""The server behind ``olivevib serve``: textual-serve with a page of our own, for one origin only.

Its own page links a font host outside, and any web page could open its socket. Here everything
comes from this computer, and a request that names another host, or comes from another page, is
refused.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from urllib.parse import urlsplit

from aiohttp import web
from textual_serve.server import Server

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]
Middleware = Callable[[web.Request, Handler], Awaitable[web.StreamResponse]]


class LocalServer(Server):  # type: ignore[misc]  # textual-serve has no types that mypy knows
    """Serves an app, a process a window."""

    def __init__(self, command: str, host: str, port: int) -> None:
        place = f"[{host}]" if ":" in host else host
        super().__init__(
            *(command, host, port, "olivevib", f"http://{place}:{port}"), templates_path=PAGES
        )

    async def on_startup(self, app: web.Application) -> None:
        """Say nothing: the verb has told where the app is."""

    async def _make_app(self) -> web.Application:
        app: web.Application = await super()._make_app()
        app.middlewares.append(same_origin(urlsplit(self.public_url).netloc))
        return app


PAGES = str(Path(__file__).parent)


def same_origin(place: str) -> Middleware:
    """Refuse what was asked of another host name, or by a page from elsewhere."""

    async def check(request: web.Request, handler: Handler) -> web.StreamResponse:
        origin = request.headers.get("Origin")
        if request.host != place or (origin and urlsplit(origin).netloc != place):
            raise web.HTTPForbidden(text=f"olivevib serves http://{place} only.")
        return await handler(request)

    made: Middleware = web.middleware(check)
    return made
