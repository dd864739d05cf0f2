"""On the path of every program that a page starts: what it asks of a service's own address goes to its fake."""

import json
import os

REDIRECTED = json.loads(os.environ.get("DOCS_REDIRECTED", "{}"))

if REDIRECTED:
    import httpx2

    from manitwin.models.services.connections import GuardedTransport

    plain = httpx2.HTTPTransport()

    def handle_request(self: GuardedTransport, request: httpx2.Request) -> httpx2.Response:
        url = str(request.url)
        for documented, fake in REDIRECTED.items():
            if url == documented or url.startswith(f"{documented}/"):
                request.url = httpx2.URL(fake + url.removeprefix(documented))
                return plain.handle_request(request)
        raise AssertionError(f"a page asks {url}, which no fake stands for")

    GuardedTransport.handle_request = handle_request  # type: ignore[method-assign]
