"""Who reaches the page: requests of other web pages, under foreign names and without the key."""

import socket
from collections.abc import Callable, Iterator, Mapping
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Thread
from typing import Any
from urllib.parse import urlsplit

import pytest
from hypothesis import given
from hypothesis import strategies as st
from websockets.exceptions import InvalidStatus

from generator.diagnostics import MoverError
from generator.viewer.access import Access, check_guard, cookie_name, is_loopback
from generator.viewer.server import LOOPBACK, PageServer, address
from generator.viewer.viewer import Viewer
from tests.browser import WAIT, go_to_page, node_pose
from tests.generator.viewer.conftest import SUBPROTOCOL, open_websocket, own_headers, wait_until

REFUSED: dict[str, Mapping[str, str]] = {
    "a foreign page": {"Origin": "https://evil.example"},
    "a page on another port": {"Origin": "http://127.0.0.1:3000"},
    "a page over TLS": {"Origin": "https://HOST"},
    "a page without origin": {"Origin": "null"},
    "a file": {"Origin": "file://"},
    "a rebound name": {"Host": "evil.example", "Origin": "http://evil.example"},
    "a rebound name with the port": {"Host": "evil.example:PORT"},
    "a name that begins with an own one": {"Host": "127.0.0.1.evil.example:PORT"},
    "a host after a user": {"Host": "evil.example@127.0.0.1:PORT"},
    "a page of another machine": {"Host": "192.0.2.1:PORT"},
    "no host": {"Host": ""},
    "two origins": {"Origin": "http://HOST, https://evil.example"},
    "no key": {"Cookie": ""},
    "a wrong key": {"Cookie": "NAME=" + 32 * "A"},
    "an empty key": {"Cookie": "NAME="},
    "a key that is not ASCII": {"Cookie": "NAME=\xe4\xf6"},
    "the key of another page": {"Cookie": "mover-page-1=KEY"},
}


def status_of(
    server: PageServer, headers: Mapping[str, str], path: str = "/"
) -> tuple[int, bytes, Mapping[str, str]]:
    """Status, content and headers of an answer; empty headers are left out of the request."""
    connection = HTTPConnection(LOOPBACK, server.get_port(), timeout=WAIT)
    connection.putrequest("GET", path, skip_host=True)
    for name, value in headers.items():
        if value:
            connection.putheader(name, value.encode("latin-1"))
    connection.endheaders()
    answer = connection.getresponse()
    with answer:
        return answer.status, answer.read(), dict(answer.getheaders())


@pytest.mark.parametrize("kind", REFUSED)
@pytest.mark.parametrize("is_websocket", [True, False])
def test_requests_of_others_are_refused(server: PageServer, kind: str, is_websocket: bool):
    port = server.get_port()
    headers = own_headers(server)
    for name, value in REFUSED[kind].items():
        words = {"HOST": headers["Host"], "PORT": str(port), "NAME": cookie_name(port)}
        for word, meant in {**words, "KEY": server.access.key}.items():
            value = value.replace(word, meant)
        headers[name] = value
    if is_websocket and headers["Host"] and "@" not in headers["Host"]:
        with pytest.raises(InvalidStatus) as refused:
            open_websocket(server, headers)
        assert refused.value.response.status_code == 403
    else:
        upgrade = {"Connection": "Upgrade", "Upgrade": "websocket"} if is_websocket else {}
        status, content, _ = status_of(server, {**headers, **upgrade})
        assert status in ((400, 403) if not headers["Host"] else (403,))
        assert len(content) < 200


@pytest.mark.parametrize("origin", ["", "http://127.0.0.1:PORT"])
def test_a_request_without_a_key_is_refused_whatever_its_origin(server: PageServer, origin: str):
    origin = origin.replace("PORT", str(server.get_port()))
    headers = {**own_headers(server), "Origin": origin, "Cookie": ""}
    with pytest.raises(InvalidStatus):
        open_websocket(server, headers)
    for path in ("/", "/index.html", "/hdri/studio.exr", f"/?key={32 * 'A'}", "/?key=", "/?Key=1"):
        assert status_of(server, headers, path)[0] == 403
        with pytest.raises(InvalidStatus):
            open_websocket(server, headers, path)


@pytest.mark.parametrize("host", [LOOPBACK, "localhost", "[::1]", "127.0.0.2"])
def test_the_page_itself_is_answered(server: PageServer, host: str):
    headers = own_headers(server, host)
    for one in (headers, {**headers, "Origin": ""}, {**headers, "Host": headers["Host"].upper()}):
        assert status_of(server, one)[1].startswith(b"<!doctype html>")
    with open_websocket(server, headers) as page:
        assert page.subprotocol == SUBPROTOCOL
        assert len(page.recv(WAIT)) > 100


def test_a_client_without_origin_needs_the_key_alone(server: PageServer):
    with open_websocket(
        server, {"Host": own_headers(server)["Host"]}, f"/?key={server.access.key}"
    ) as client:
        assert len(client.recv(WAIT)) > 100


def test_the_printed_address_sets_a_cookie_and_hides_the_key(server: PageServer):
    parts = urlsplit(address(server, LOOPBACK))
    status, text, headers = status_of(server, {"Host": parts.netloc}, f"{parts.path}?{parts.query}")
    assert status == 200
    assert b'content="0; url=/"' in text
    assert server.access.key.encode() not in text
    assert headers["Referrer-Policy"] == "no-referrer"
    cookie, *attributes = headers["Set-Cookie"].split("; ")
    assert cookie == f"{cookie_name(server.get_port())}={server.access.key}"
    assert set(attributes) == {"HttpOnly", "SameSite=Strict", "Path=/"}


def test_a_page_for_other_machines_is_reached_by_addresses_and_its_names(open_to_all: PageServer):
    for host in ("192.0.2.1", "[2001:db8::1]", socket.gethostname(), LOOPBACK):
        assert status_of(open_to_all, own_headers(open_to_all, host))[0] == 200
        assert status_of(open_to_all, {**own_headers(open_to_all, host), "Cookie": ""})[0] == 403
    assert status_of(open_to_all, own_headers(open_to_all, "evil.example"))[0] == 403


def test_each_page_has_a_key_of_its_own():
    assert len({Access(LOOPBACK).key for _ in range(50)}) == 50


@given(st.text(st.characters(max_codepoint=255, exclude_characters="\r\n"), max_size=30))
def test_no_other_text_is_the_host(text: str):
    access = Access(LOOPBACK)
    name = text.lower().rpartition(":")[0] if text.rpartition(":")[2].isdigit() else text.lower()
    if access._is_own_host(text):
        name = name.removesuffix(":").strip("[]")
        assert name == "localhost" or is_loopback(name)


@pytest.mark.parametrize(
    ("host", "answer"),
    [
        ("127.0.0.1", True),
        ("127.8.0.1", True),
        ("::1", True),
        ("localhost", True),
        ("0.0.0.0", False),
        ("192.0.2.1", False),
        ("localhost.example", False),
        ("", False),
    ],
)
def test_addresses_of_this_machine_only(host: str, answer: bool):
    assert is_loopback(host) is answer


def test_a_server_that_does_not_answer_fails_its_check():
    with socket.create_server((LOOPBACK, 0)) as taken:
        port = taken.getsockname()[1]
    with pytest.raises(MoverError, match="does not answer its own check"):
        check_guard(LOOPBACK, port)


FOREIGN = """address => new Promise(done => {
    const opened = new WebSocket(address, ["SUBPROTOCOL"]);
    opened.onmessage = () => done("state received");
    opened.onclose = () => done("closed");
})""".replace("SUBPROTOCOL", SUBPROTOCOL)


class _ForeignPage(BaseHTTPRequestHandler):
    """A page of another server of this machine, to which browsers send the cookies of the host."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<p>a foreign page</p>")

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""


@pytest.fixture
def foreign_port() -> Iterator[int]:
    with ThreadingHTTPServer((LOOPBACK, 0), _ForeignPage) as foreign:
        thread = Thread(target=foreign.serve_forever, daemon=True)
        thread.start()
        yield foreign.server_port
        foreign.shutdown()
        thread.join()


@pytest.mark.slow
def test_a_browser_opens_reloads_and_shares_a_page_that_foreign_pages_do_not_reach(
    run_viewer: Callable[..., Any], browser: Any, foreign_port: int
):
    running = run_viewer("pendulum", ())
    viewer: Viewer = running.viewer
    node = f"/figure/{next(iter(viewer.scene.meshes))}"
    port = running.server.get_port()
    context = browser.new_context(viewport={"width": 600, "height": 400})
    try:
        first = context.new_page()
        go_to_page(first, running.address)
        wait_until(lambda: node_pose(first, node) is not None)
        assert first.url == f"http://127.0.0.1:{port}/"
        assert first.evaluate("document.cookie") == ""
        first.reload()
        wait_until(lambda: node_pose(first, node) is not None)
        second = context.new_page()
        second.goto(f"http://127.0.0.1:{port}/")
        wait_until(lambda: node_pose(second, node) is not None)
        wait_until(lambda: len(running.server.get_clients()) == 2)
        for host in (LOOPBACK, "localhost"):
            foreign = context.new_page()
            foreign.goto(f"http://{host}:{foreign_port}/")
            for name in (LOOPBACK, "localhost"):
                assert foreign.evaluate(FOREIGN, f"ws://{name}:{port}/") == "closed"
            foreign.close()
        own = second.evaluate(FOREIGN, f"ws://{LOOPBACK}:{port}/")
        assert own == "state received"  # so that the page is what is refused
        clicking = browser.new_context().new_page()
        clicking.goto(f"http://localhost:{foreign_port}/")
        clicking.set_content(f'<a href="{running.address}">the printed address</a>')
        clicking.click("a")
        clicking.wait_for_url(f"http://127.0.0.1:{port}/")
        wait_until(lambda: node_pose(clicking, node) is not None)
        clicking.context.close()
        stranger = browser.new_context().new_page()
        answer = stranger.goto(f"http://127.0.0.1:{port}/")
        assert answer.status == 403
        assert "Open the address that `mover view` has printed" in stranger.content()
        stranger.context.close()
    finally:
        context.close()
