"""Who may see the page of a studio, and what they see before its scripts run."""

from __future__ import annotations

import base64
import time
from collections.abc import Awaitable, Callable
from html import escape
from pathlib import Path
from typing import Any

from aiohttp import web
from trame_client.module import vue3

INDEX = "/index.html"

BAR, TREE = 48, 360
"""Height of the bar above the picture, and width of the tree beside it, pixels."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class Gate:
    """Refuses requests to other hosts and from other sites, keeps the token in a cookie, and counts tabs.

    `picture` makes a JPEG of what the page will show. The page comes up with it, and without waiting for one
    script to ask for the next.
    """

    def __init__(self, server: Any, token: str, picture: Callable[[], bytes]) -> None:
        self._server, self._token, self._picture = server, token, picture
        self.tabs, self._since = 0, time.monotonic()
        server.controller.on_server_bind.add(self._stand)

    @property
    def empty_for(self) -> float:
        """Time since the last tab was closed, seconds; 0 if there is one."""
        return 0.0 if self.tabs else time.monotonic() - self._since

    @property
    def path(self) -> str:
        """Path of the page, with the token."""
        return f"{INDEX}?secret={self._token}"

    def _stand(self, bound: Any) -> None:
        @web.middleware
        async def answer(request: web.Request, handler: Handler) -> web.StreamResponse:
            if not _is_own(request, bound):
                raise web.HTTPForbidden(text="expected the address that fracslice studio has printed")
            return await self._answer(request, handler)

        bound.app.middlewares.append(answer)

    async def _answer(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        if request.path == INDEX:
            return self._index(request)
        is_tab = request.headers.get("Upgrade", "").lower() == "websocket"
        self.count(is_tab)
        try:
            return await handler(request)
        finally:
            self.count(-is_tab)

    def count(self, more: int) -> None:
        """Note that a tab was opened (1) or closed (-1)."""
        self.tabs, self._since = self.tabs + more, time.monotonic()

    def _index(self, request: web.Request) -> web.Response:
        """The page; a browser keeps the token, which a script takes out of the address, for a reload."""
        name, given = f"fracslice-{self._server.port}", request.query.get("secret")
        if given is None and request.cookies.get(name) == self._token:
            raise web.HTTPFound(self.path)
        frame = (Path(vue3.www) / INDEX[1:]).read_text(encoding="utf-8")
        if given != self._token:
            return web.Response(text=frame, content_type="text/html")
        text = frame.replace("</head>", f"{self._hints()}</head>").replace("<body>", f"<body>{self._first()}")
        response = web.Response(text=text, content_type="text/html")
        response.set_cookie(name, self._token, httponly=True, samesite="Strict")
        return response

    def _hints(self) -> str:
        """Elements that have a browser fetch at once what the scripts would ask for one after the other."""
        state = self._server.state
        kinds = ("script", state.trame__scripts), ("style", state.trame__styles)
        return "".join(
            f'<link rel="preload" as="{kind}" href="{escape(file)}">'
            for kind, files in kinds
            for file in files
        )

    def _first(self) -> str:
        """The picture, where the page will have it."""
        data = base64.b64encode(self._picture()).decode()
        place = f"position: fixed; z-index: -1; top: {BAR}px; left: {TREE}px; object-fit: contain"
        size = f"width: calc(100vw - {TREE}px); height: calc(100vh - {BAR}px); background: #181a1d"
        return f'<img alt="" style="{place}; {size}" src="data:image/jpeg;base64,{data}">'


def _is_own(request: web.Request, bound: Any) -> bool:
    """True for a request to the address of a server, by itself or by its own page."""
    known = {f"{name}:{bound.get_port()}" for name in ("127.0.0.1", "localhost", "[::1]", bound.host)}
    origin = request.headers.get("Origin")
    return request.host in known and (not origin or origin.partition("//")[2] in known)
