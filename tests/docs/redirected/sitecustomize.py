"""On the path of every program that a page starts: what it asks of a service's own address goes to its fake."""

import json
import os

REDIRECTED = json.loads(os.environ.get("DOCS_REDIRECTED", "{}"))

if REDIRECTED:
    import httpx2

    send = httpx2.HTTPTransport.handle_request

    def handle_request(self: httpx2.HTTPTransport, request: httpx2.Request) -> httpx2.Response:
        url = str(request.url)
        for documented, fake in REDIRECTED.items():
            if url == documented or url.startswith(f"{documented}/"):
                request.url = httpx2.URL(fake + url.removeprefix(documented))
                return send(self, request)
        raise AssertionError(f"a page asks {url}, which no fake stands for")

    httpx2.HTTPTransport.handle_request = handle_request  # type: ignore[method-assign]
