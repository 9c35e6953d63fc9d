"""Who may open the viewer's page: its own origin alone.

Any page that a browser has open may connect to a websocket of this machine; the browser sends its Origin and leaves the
judgement to the server. A page of another site may also be served under a name that is pointed at this machine later
(DNS rebinding): then Origin and Host agree, but the Host is no name of ours.
"""

from __future__ import annotations

import functools
import http
import ipaddress
import socket
from collections.abc import Callable
from typing import Any
from urllib.parse import urlsplit

import websockets.asyncio.server
from websockets.datastructures import Headers
from websockets.http11 import Request, Response

_HERE = ("localhost", "127.0.0.1", "::1")
_EVERYWHERE = ("0.0.0.0", "::")


def refusal(served: str, hosts: list[str], origins: list[str], websocket: bool) -> str | None:
    """Why a request is refused, None where it is not.

    Args:
        served: address that the page is bound to. hosts, origins: values of the request's Host and Origin headers.
    """
    if len(hosts) != 1 or (name := _name(hosts[0])) is None:
        return f"Host: found {hosts}, expected one"
    if not _ours(served, name):
        return f"Host: {hosts[0]!r} is no name of this page's server"
    if websocket and [origin.casefold() for origin in origins] not in (
        [f"{scheme}://{hosts[0].casefold()}"] for scheme in ("http", "https")
    ):
        return f"Origin: found {origins}, expected http://{hosts[0]}"
    return None


def _ours(served: str, name: str) -> bool:
    """By an address nobody can be led here from elsewhere, where everyone may come anyway; by a name they can."""
    if name in _HERE or name == served.casefold():
        return True
    own = socket.gethostname().casefold()
    return served in _EVERYWHERE and (_is_address(name) or name in (own, f"{own}.local"))


def _name(host: str) -> str | None:
    try:
        parts = urlsplit(f"//{host}")
        return None if parts.netloc != host or "@" in host else parts.hostname
    except ValueError:
        return None


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class OwnOrigin:
    """While it is entered, servers of websockets refuse what `refusal` refuses, before anything else sees it.

    Attributes:
        guards: servers that it guards so far.
    """

    def __init__(self, served: str) -> None:
        self.served, self.guards = served, 0
        self._serve: Callable[..., Any] = websockets.asyncio.server.serve

    def __enter__(self) -> OwnOrigin:
        @functools.wraps(self._serve)
        def serve(*args: Any, process_request: Callable[..., Any] | None = None, **options: Any) -> Any:
            self.guards += 1
            return self._serve(*args, process_request=self._guarded(process_request), **options)

        websockets.asyncio.server.serve = serve  # type: ignore[assignment,misc]
        return self

    def __exit__(self, *_: object) -> None:
        websockets.asyncio.server.serve = self._serve  # type: ignore[assignment,misc]

    def _guarded(self, inner: Callable[..., Any] | None) -> Callable[..., Any]:
        def process(connection: Any, request: Request) -> Any:
            headers = request.headers
            why = refusal(self.served, headers.get_all("Host"), headers.get_all("Origin"), "Upgrade" in headers)
            if why is not None:
                body = f"{why}\n".encode()
                about = Headers({"Content-Type": "text/plain; charset=utf-8", "Content-Length": str(len(body))})
                return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", about, body)
            return None if inner is None else inner(connection, request)

        return process
