"""Fake of OpenAI's images endpoint (https://platform.openai.com/docs/api-reference/images/create)."""

from __future__ import annotations

import base64

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.pictures import picture_png
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import FILES, with_outages

PLACE = "/images/generations"
BLOCKED = "forbidden"
"""A prompt with this word is refused, to simulate a safety system."""
REFUSALS = {
    "unauthorized": (401, {"error": {"message": "Incorrect API key provided", "type": "invalid_request_error"}}),
    "rate_limited": (429, {"error": {"message": "Rate limit reached", "type": "requests"}}),
    "server_error": (500, {"error": {"message": "The server had an error", "type": "server_error"}}),
}


class FakeOpenAiImages:
    """Answers immediately with a picture, as ``b64_json`` or, if ``by_url``, as a link; ``drawn`` lists the charged prompts."""

    def __init__(self, faults: Faults | None = None, key: str = "rehearsal-key", *, by_url: bool = False):
        self.faults, self.key, self.by_url = faults or Faults(), key, by_url
        self.drawn: list[str] = []

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request like the endpoint."""
        if request.path.startswith(FILES):
            return Response(200, picture_png(int(request.path.removeprefix(FILES))), {"Content-Type": "image/png"})
        if request.headers.get("authorization") != f"Bearer {self.key}":
            return Response(*REFUSALS["unauthorized"])
        return with_outages(self.faults, REFUSALS, lambda: self._drawn(request, base_url))

    def _drawn(self, request: Request, base_url: str) -> Response:
        if request.method != "POST" or request.path.rstrip("/") != PLACE:
            return Response(404, {"error": {"message": f"Unknown request URL: {request.path}"}})
        body = request.json()
        prompt = body.get("prompt")
        if not isinstance(prompt, str) or not body.get("model"):
            return Response(400, {"error": {"message": "prompt and model are required"}})
        if BLOCKED in prompt:
            told = {"message": "Your request was rejected by the safety system", "code": "content_policy_violation"}
            return Response(400, {"error": told})
        self.drawn.append(prompt)
        number = len(self.drawn)
        if self.by_url:
            return Response(200, {"created": 1, "data": [{"url": f"{base_url}{FILES}{number}"}]})
        return Response(200, {"created": 1, "data": [{"b64_json": base64.b64encode(picture_png(number)).decode()}]})
