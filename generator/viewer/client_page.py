"""The page of viser's client, with a style for phones and a script that chooses tabs.

The library has no option for either: its controls of narrow windows lie over the lower 60 % of the
page, their choice of a tab is lost with the window's width, and no program can choose one.
"""

import gzip
from functools import cache
from importlib.resources import files

from websockets.datastructures import Headers
from websockets.http11 import Response

PHONE_WIDTH = 576
"""Largest width of a page on which the controls are below the figure [pixels]."""

_END_OF_HEAD = b"</head>"


def with_additions(response: Response) -> Response:
    """Return an answer of viser with our additions, if it is a page; else as it is."""
    if not response.headers.get("Content-Type", "").startswith("text/html"):
        return response
    is_packed = response.headers.get("Content-Encoding") == "gzip"
    body = _extended(bytes(response.body), is_packed)
    headers = Headers(response.headers.raw_items())
    del headers["Content-Length"]
    headers["Content-Length"] = str(len(body))
    return Response(response.status_code, response.reason_phrase, headers, body)


@cache
def _extended(body: bytes, is_packed: bool) -> bytes:
    """Return a page with the additions at the end of its head."""
    page = gzip.decompress(body) if is_packed else body
    additions = files("generator.viewer").joinpath("page_assets", "additions.html").read_bytes()
    page = page.replace(_END_OF_HEAD, additions + _END_OF_HEAD, 1)
    return gzip.compress(page) if is_packed else page
