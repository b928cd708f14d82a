"""The server of the page: viser on the loopback address, without a way to the outside."""

import errno
import io
import socket
from contextlib import redirect_stdout
from ipaddress import ip_address

import viser

from generator.diagnostics import UsageError
from generator.text_io import os_error_reason

LOOPBACK = "127.0.0.1"

DEFAULT_PORT = 8080

CONTROLS_WIDTH = 400
"""Width of the controls with their margin [pixels]."""

_PORTS_TRIED = 100
"""Ports that are tried, from the default one."""


_NO_ADDRESS = (errno.EADDRNOTAVAIL, socket.EAI_NONAME, socket.EAI_AGAIN, socket.EAI_FAIL)
"""Errors of a name that has no address, or of an address of another machine."""


class PageServer(viser.ViserServer):
    """A viser server that never opens a tunnel to another host."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse to share the page: return None."""
        return None

    def set_theme(self, *, is_dark: bool) -> None:
        """Set the colours of the controls."""
        self.gui.configure_theme(
            dark_mode=is_dark, show_logo=False, show_share_button=False, control_width="large"
        )


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches a server at `host`."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


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
    """Start the server of an empty page with y up."""
    with redirect_stdout(io.StringIO()):
        server = PageServer(host, port, label=title, verbose=False)
    server.set_theme(is_dark=False)
    server.scene.set_up_direction("+y")
    server.scene.configure_environment_map(None)
    return server


def close_server(server: PageServer) -> None:
    """Stop a server and disconnect its pages."""
    with redirect_stdout(io.StringIO()):
        server.stop()


def address(server: PageServer, host: str) -> str:
    """Return the address of the page for the browser of this machine."""
    name = {"0.0.0.0": LOOPBACK, "::": "[::1]"}.get(host, f"[{host}]" if ":" in host else host)
    return f"http://{name}:{server.get_port()}"
