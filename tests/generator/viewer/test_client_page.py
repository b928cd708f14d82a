"""Additions to the page of viser's client."""

import gzip

import pytest
from websockets.datastructures import Headers
from websockets.http11 import Response

from generator.viewer.client_page import with_additions
from generator.viewer.server import PageServer
from tests.generator.viewer.test_access import own_headers, status_of

PAGE = b"<!doctype html><head><title>x</title></head><body></head></body>"


def answer(kind: str, encoding: str, body: bytes) -> Response:
    """An answer as viser makes it."""
    fields = {"Content-Type": kind, "Content-Length": str(len(body)), "Content-Encoding": encoding}
    return Response(200, "OK", Headers(**fields), body)


@pytest.mark.parametrize("encoding", ["gzip", "identity"])
def test_additions_are_at_the_end_of_the_head(encoding: str):
    body = gzip.compress(PAGE) if encoding == "gzip" else PAGE
    found = with_additions(answer("text/html; charset=utf-8", encoding, body))
    assert found.headers["Content-Length"] == str(len(found.body))
    assert found.headers.get_all("Content-Encoding") == [encoding]
    page = gzip.decompress(found.body) if encoding == "gzip" else bytes(found.body)
    before, after = PAGE.split(b"</head>", 1)
    assert page.startswith(before + b"<style>")
    assert page.endswith(b"</script>\n</head>" + after)


def test_other_answers_stay():
    found = answer("image/png", "identity", b"</head>")
    assert with_additions(found) is found


def test_the_page_of_the_server_has_them_once(server: PageServer):
    for path in ("/", "/index.html"):
        status, content, _ = status_of(server, own_headers(server), path)
        assert status == 200
        assert content.count(b"@media (max-width: 36em)") == 1
