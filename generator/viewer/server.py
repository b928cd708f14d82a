"""The server of the page: viser on the loopback address, for browsers with the key of the page."""

import asyncio
import errno
import io
import socket
from collections.abc import Callable
from contextlib import redirect_stdout
from functools import partial
from typing import Any

import viser

from generator.diagnostics import MoverError, UsageError
from generator.text_io import os_error_reason
from generator.viewer.access import KEY, Access, check_guard, guarded_websockets
from generator.viewer.browser_messages import BrowserConnection, line_logger, report

LOOPBACK = "127.0.0.1"

DEFAULT_PORT = 8080

CONTROLS_WIDTH = 340
"""Width of the controls with their margin [pixels]."""

_PORTS_TRIED = 100
"""Ports that are tried, from the default one."""


_ALL_ADDRESSES = {"0.0.0.0": LOOPBACK, "::": "::1"}
"""Addresses that mean all those of this machine, with the one by which it reaches itself."""

_NO_ADDRESS = (errno.EADDRNOTAVAIL, socket.EAI_NONAME, socket.EAI_AGAIN, socket.EAI_FAIL)
"""Errors of a name that has no address, or of an address of another machine."""


class PageServer(viser.ViserServer):
    """A viser server for browsers with its key, which never opens a tunnel to another host.

    `notify` gets a sentence about a value that a control does not take.
    """

    def __init__(self, host: str, port: int, title: str) -> None:
        """Start the server. Raises MoverError if it answers requests without the key."""
        self.access = Access(host)
        self.notify: Callable[[str], None] = report
        connect = partial(
            BrowserConnection,
            find_control=self._find_control,
            notify=lambda text: self.notify(text),
        )
        with guarded_websockets(self.access, connect, line_logger()):
            super().__init__(  # pyright: ignore[reportUnknownMemberType]
                host, port, label=title, verbose=False
            )
        self.get_event_loop().call_soon_threadsafe(_report_failures, self.get_event_loop())

    def _find_control(self, identifier: str) -> Any:
        """Return the control with an identifier of viser, or None."""
        controls = self.gui._gui_input_handle_from_uuid  # pyright: ignore[reportPrivateUsage]
        return controls.get(identifier)

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse to share the page: return None."""
        return None

    def set_theme(self, *, is_dark: bool) -> None:
        """Set the colours of the controls."""
        self.gui.configure_theme(
            dark_mode=is_dark, show_logo=False, show_share_button=False, control_width="medium"
        )


def _report_failures(loop: asyncio.AbstractEventLoop) -> None:
    """Print a line for a message that viser cannot carry out, instead of a traceback."""

    def print_line(_loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        failure = context.get("exception")
        cause = "" if failure is None else f": {type(failure).__name__}: {failure}"
        report(f"{context.get('message', '')}{cause}")

    loop.set_exception_handler(print_line)


def find_port(host: str, port: int | None) -> int:
    """Return a port of `host` that can be listened to; of None, the first free one from 8080.

    Raises:
        UsageError: the port is in use, or the host is not an address of this machine.
    """
    family = _address_family(host)
    ports = range(DEFAULT_PORT, DEFAULT_PORT + _PORTS_TRIED) if port is None else (port,)
    reason = ""
    for candidate in ports:
        try:
            with socket.create_server((host, candidate), family=family):
                return candidate
        except OverflowError:
            raise UsageError(f"--port {candidate}: ports are 1 to 65535") from None
        except OSError as failure:
            if failure.errno in _NO_ADDRESS:
                raise UsageError(f"--host {host}: not an address of this machine") from None
            reason = os_error_reason(failure).split(" (while")[0]
    if port is None:
        raise UsageError(f"--host {host}: no port from {ports[0]} to {ports[-1]} is free: {reason}")
    raise UsageError(f"--port {port} of {host} cannot be used: {reason}; without --port, a free "
                     "one is chosen")  # fmt: skip


def _address_family(host: str) -> socket.AddressFamily:
    """Return the family of the first address of a host. Raises UsageError without one."""
    try:
        return socket.getaddrinfo(host, None, type=socket.SOCK_STREAM)[0][0]
    except (OSError, UnicodeError):
        raise UsageError(f"--host {host}: not an address of this machine") from None


def open_server(host: str, port: int, title: str) -> PageServer:
    """Start the server of an empty page with y up.

    Raises MoverError if it answers requests without the key of the page.
    """
    with redirect_stdout(io.StringIO()):
        server = PageServer(host, port, title)
    try:
        check_guard(reachable_host(host), server.get_port())
    except MoverError:
        close_server(server)
        raise
    server.set_theme(is_dark=False)
    server.scene.set_up_direction("+y")
    server.scene.configure_environment_map(None)
    return server


def close_server(server: PageServer) -> None:
    """Stop a server and disconnect its pages."""
    with redirect_stdout(io.StringIO()):
        server.stop()


def reachable_host(host: str) -> str:
    """Return an address at which this machine reaches a server that listens at `host`."""
    return _ALL_ADDRESSES.get(host, host)


def address(server: PageServer, host: str) -> str:
    """Return the address of the page, with its key, for a browser that reaches it by `host`.

    An address of all hosts means this machine.
    """
    name = reachable_host(host)
    name = f"[{name}]" if ":" in name else name
    return f"http://{name}:{server.get_port()}/?{KEY}={server.access.key}"


def address_for_others(server: PageServer, host: str) -> str:
    """Return the address of the page for browsers of other machines; arguments as of `address`."""
    return address(server, socket.gethostname() if host in _ALL_ADDRESSES else host)
