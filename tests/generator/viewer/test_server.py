"""The server of the page: its port, its addresses, and that it stays on this machine."""

import inspect
import socket
from collections.abc import Callable, Iterator
from contextlib import nullcontext
from typing import Any

import pytest

from generator.cli.view import view
from generator.diagnostics import MoverError, UsageError
from generator.viewer.access import is_loopback
from generator.viewer.panels import PANELS
from generator.viewer.server import (
    DEFAULT_PORT,
    LOOPBACK,
    PageServer,
    address,
    address_for_others,
    close_server,
    find_port,
    open_server,
)
from generator.viewer.viewer import Viewer
from tests.browser import open_address
from tests.generator.viewer.conftest import content_of


@pytest.fixture
def used_port() -> Iterator[int]:
    """A port of the loopback address at which another program listens."""
    with socket.create_server((LOOPBACK, 0)) as listening:
        yield listening.getsockname()[1]


def test_the_page_is_on_the_loopback_address_by_default():
    default = inspect.signature(view).parameters["host"].default
    assert default == LOOPBACK
    assert is_loopback(default)


def test_a_port_in_use_is_refused_and_another_one_is_found(used_port: int):
    with pytest.raises(UsageError, match=rf"--port {used_port} .*cannot be used.*without --port"):
        find_port(LOOPBACK, used_port)
    assert find_port(LOOPBACK, None) >= DEFAULT_PORT


def test_a_page_may_have_an_address_of_version_6():
    try:
        with socket.create_server(("::1", 0), family=socket.AF_INET6):
            pass
    except OSError:
        pytest.skip("this machine has no address of version 6")
    server = open_server("::1", find_port("::1", None), "title")
    try:
        assert open_address(address(server, "::1")).startswith(b"<!doctype html>")
    finally:
        close_server(server)


def test_the_first_free_port_is_found(monkeypatch: pytest.MonkeyPatch, used_port: int):
    monkeypatch.setattr("generator.viewer.server.DEFAULT_PORT", used_port)
    assert find_port(LOOPBACK, None) > used_port


@pytest.mark.parametrize(
    ("host", "port", "sentence"),
    [
        (LOOPBACK, 70000, "--port 70000: ports are 1 to 65535"),
        *((host, None, "not an address of this machine") for host in ("", "a" * 300, "-", "a..b")),
        ("192.0.2.1", None, "--host 192.0.2.1: not an address of this machine"),
        ("192.0.2.1", 8080, "--host 192.0.2.1: not an address of this machine"),
        ("no such host.invalid", 8080, "not an address of this machine"),
    ],
)
def test_a_wrong_port_or_host_is_refused(host: str, port: int | None, sentence: str):
    with pytest.raises(UsageError, match=sentence):
        find_port(host, port)


def test_a_server_of_the_loopback_address_is_not_reached_at_others(server: PageServer):
    port = server.get_port()
    with socket.create_connection((LOOPBACK, port), timeout=5.0):
        pass
    with pytest.raises(ConnectionRefusedError):  # which a server of all addresses would accept
        socket.create_connection(("127.0.0.2", port), timeout=5.0)


def test_a_server_that_answers_everybody_is_not_opened(monkeypatch: pytest.MonkeyPatch):
    """As if a later viser started its server in another way, so that the guard is not in force."""
    monkeypatch.setattr("generator.viewer.server.guarded_websockets", lambda *_: nullcontext())
    port = find_port(LOOPBACK, None)
    with pytest.raises(MoverError, match="every web page could use it"):
        open_server(LOOPBACK, port, "title")
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((LOOPBACK, port), timeout=5.0)


def test_no_connection_to_another_host(tmp_path, monkeypatch: pytest.MonkeyPatch):
    """A server, its viewer and all panels connect to nothing but this machine."""
    asked: list[object] = []
    connect, connect_ex = socket.socket.connect, socket.socket.connect_ex

    def within(method: Callable[..., Any]) -> Callable[..., Any]:
        def call(self: socket.socket, where: Any) -> Any:
            if where[0] == LOOPBACK:
                return method(self, where)
            asked.append(where)
            raise OSError("no network")

        return call

    monkeypatch.setattr(socket.socket, "connect", within(connect))
    monkeypatch.setattr(socket.socket, "connect_ex", within(connect_ex))
    opened = open_server(LOOPBACK, find_port(LOOPBACK, None), "title")
    viewer = Viewer(opened, content_of("fourbar", tmp_path), PANELS)
    viewer.run_once(0.0)
    assert opened.request_share_url() is None
    viewer.close()
    close_server(opened)
    assert not asked


@pytest.mark.parametrize(
    ("host", "name"),
    [("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "127.0.0.1"), ("::", "[::1]"), ("::1", "[::1]")],
)
def test_the_address_is_one_that_a_browser_opens(server: PageServer, host: str, name: str):
    start, _, key = address(server, host).partition("/?key=")
    assert start == f"http://{name}:{server.get_port()}"
    assert key == server.access.key
    assert len(key) >= 32


def test_other_machines_use_the_name_of_this_one(server: PageServer):
    for host, name in (("0.0.0.0", socket.gethostname()), ("192.0.2.1", "192.0.2.1")):
        expected = f"http://{name}:{server.get_port()}/?key={server.access.key}"
        assert address_for_others(server, host) == expected
