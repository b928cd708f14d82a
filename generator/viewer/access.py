"""Access to the page: which requests its server answers.

Any web page that is open in a browser of this machine can send requests to a server of the loopback
address. The server therefore answers only requests that name one of its own hosts (a foreign name
may lead to this machine: DNS rebinding), that come from its own origin, and that have the key of
the page. The address that is printed has the key as a parameter; the answer to it is a cookie with
the key, and a text that leads to the address without it. (A redirect would lose a strict cookie
where the address is a link of another page, as in a terminal in the browser.) Cookies are of a
host, not of a port: the name of the cookie has the port, so that two pages may be open.
"""

import hmac
import secrets
import socket
from collections.abc import Callable, Generator
from contextlib import contextmanager
from http import HTTPStatus
from http.client import HTTPConnection, HTTPException
from ipaddress import ip_address
from threading import Lock
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio import server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.http11 import Request, Response

from generator.diagnostics import MoverError
from generator.viewer.client_page import with_additions

KEY = "key"
"""Parameter of the address that is printed."""

MAX_FRAME = 64 * 1024
"""Most bytes of a message of a browser; the largest are texts that were typed."""

_FOREIGN_HOST = "This page has another address."
_FOREIGN_ORIGIN = "This page answers no requests of other pages."
_NO_KEY = "Open the address that `mover view` has printed: it has the key of this page."

_ENTRANCE = '<!doctype html><meta http-equiv="refresh" content="0; url=/"><title>Mover</title>\n'

_KEY_BYTES = 24

_PATCHING = Lock()

Answer = Callable[[ServerConnection, Request], Any]
"""Returns the response to a request, None to open the websocket, or either later."""


class Access:
    """The key of a page and the names of its host."""

    def __init__(self, host: str) -> None:
        """Draw a key for a server that listens at `host`."""
        self.key = secrets.token_urlsafe(_KEY_BYTES)
        self._is_local = is_loopback(host)
        self._names = {"localhost", host.lower()}
        if not self._is_local:
            self._names.add(socket.gethostname().lower())

    def answer(self, connection: ServerConnection, request: Request) -> Response | None:
        """Return the response to a request that is refused or has the key; None for a cookie."""
        hosts, origins = (request.headers.get_all(name) for name in ("Host", "Origin"))
        if len(hosts) != 1 or not self._is_own_host(hosts[0]):
            return connection.respond(HTTPStatus.FORBIDDEN, _FOREIGN_HOST)
        if any(origin.lower() != f"http://{hosts[0].lower()}" for origin in origins):
            return connection.respond(HTTPStatus.FORBIDDEN, _FOREIGN_ORIGIN)
        port = connection.local_address[1]
        is_key_in_address = self._is_key(parse_qs(urlsplit(request.path).query).get(KEY, []))
        if not (is_key_in_address or self._is_key(_cookies(request, cookie_name(port)))):
            return connection.respond(HTTPStatus.FORBIDDEN, _NO_KEY)
        if not is_key_in_address or "Upgrade" in request.headers:
            return None
        response = connection.respond(HTTPStatus.OK, _ENTRANCE)
        del response.headers["Content-Type"]
        response.headers["Content-Type"] = "text/html; charset=utf-8"
        response.headers["Referrer-Policy"] = "no-referrer"
        response.headers["Set-Cookie"] = (
            f"{cookie_name(port)}={self.key}; HttpOnly; SameSite=Strict; Path=/"
        )
        return response

    def _is_own_host(self, text: str) -> bool:
        """Return whether the header Host names this machine; only names can be rebound."""
        try:
            parts = urlsplit(f"//{text}")
            name = parts.hostname or ""
        except ValueError:
            return False
        if parts.netloc != text or "@" in text:
            return False
        if name in self._names:
            return True
        try:
            return ip_address(name).is_loopback or not self._is_local
        except ValueError:
            return False

    def _is_key(self, candidates: list[str]) -> bool:
        key = self.key.encode()
        return any(hmac.compare_digest(each.encode(errors="replace"), key) for each in candidates)


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a server at `host`."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def cookie_name(port: int) -> str:
    """Name of the cookie that has the key of a page at a port."""
    return f"mover-page-{port}"


def _cookies(request: Request, name: str) -> list[str]:
    """Values of the cookies of a name."""
    pairs = [
        part.strip().partition("=")
        for header in request.headers.get_all("Cookie")
        for part in header.split(";")
    ]
    return [value for found, _, value in pairs if found == name]


@contextmanager
def guarded_websockets(
    access: Access, make_connection: Callable[..., ServerConnection], logger: Any
) -> Generator[None]:
    """Guard the websocket server that another library starts meanwhile, also in another thread.

    The access decides before the library's own answer to a request; factory of connections and
    logger are as for `websockets.asyncio.server.serve`.
    """
    serve = websocket_server.serve

    def guarded(*arguments: Any, **options: Any) -> Any:
        own: Answer | None = options.get("process_request")

        def answer(connection: ServerConnection, request: Request) -> Any:
            refusal = access.answer(connection, request)
            if refusal is not None or own is None:
                return refusal
            found = own(connection, request)
            return with_additions(found) if isinstance(found, Response) else found

        changed = {
            "process_request": answer,
            "create_connection": make_connection,
            "max_size": MAX_FRAME,
            "logger": logger,
        }
        return serve(*arguments, **{**options, **changed})

    with _PATCHING:
        websocket_server.serve = guarded  # pyright: ignore[reportAttributeAccessIssue]
        try:
            yield
        finally:
            websocket_server.serve = serve


def check_guard(host: str, port: int) -> None:
    """Ask the server for its page and for a websocket without the key.

    Raises MoverError if it does not refuse them. A version of the library that starts its server
    in another way would be open to every web page.
    """
    upgrade = {
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
    }
    for headers in ({}, upgrade):
        connection = HTTPConnection(host, port, timeout=10.0)
        try:
            connection.request("GET", "/", headers=headers)
            status = connection.getresponse().status
        except (OSError, HTTPException) as failure:
            raise MoverError(f"the page does not answer its own check: {failure}") from None
        finally:
            connection.close()
        if status != HTTPStatus.FORBIDDEN:
            raise MoverError(
                "the page is not opened: this version of viser answers requests without the key "
                "of the page, so that every web page could use it; install viser 1.1"
            )
