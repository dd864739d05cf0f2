"""Fake server of fal's queue API with four endpoints.

Queue: https://fal.ai/docs/api-reference/inference-api (202 while under way, 200 when complete; the URLs of a request contain the
owner and the app only) and https://docs.fal.ai/model-endpoints/queue. Errors: .../documentation/model-apis/request-errors (flat,
with ``error_type``) and a list under ``detail`` for requests that the model refuses; the refusal of an account without credit is
that of github.com/fal-ai/fal issue 1147. Endpoints: https://fal.ai/models/fal-ai/trellis/multi/llms.txt (fields of trellis),
.../hyper3d/rodin/llms.txt and .../hunyuan3d-v3/text-to-3d/api. Read 2026-11. Undocumented, and assumed here: the messages of 401
and 404, the 400 for a result that is requested too early, and the refusal of unknown fields.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.json_fields import Check, complaint, number, one_of, picture_url, text, whole
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import FILES, FakeVendor

REFUSALS = {
    "unauthorized": (401, {"detail": "Cannot access application. Authentication is required."}),
    "out_of_credit": (
        403,
        {"detail": "User is locked. Reason: Exhausted balance. Top up your balance at fal.ai/dashboard/billing."},
    ),
    "rate_limited": (429, {"detail": "Too many requests"}),
    "server_error": (500, {"detail": "Internal server error"}),
}


def _pictures(value: Any) -> str | None:
    return picture_url(value[0]) if isinstance(value, list) and 1 <= len(value) <= 5 else "must be a list of URLs"


IMAGES = "images"


@dataclass(frozen=True)
class _Endpoint:
    fields: dict[str, Check]
    required: tuple[str, ...]
    output: str


ENDPOINTS = {
    "fal-ai/trellis": _Endpoint(
        {
            "image_url": picture_url,
            "seed": whole(0, 2**31 - 1),
            "ss_guidance_strength": number(0, 10),
            "ss_sampling_steps": whole(1, 50),
            "slat_guidance_strength": number(0, 10),
            "slat_sampling_steps": whole(1, 50),
            "mesh_simplify": number(0.9, 0.98),
            "texture_size": one_of(512, 1024, "512", "1024", "2048"),
        },
        ("image_url",),
        "model_mesh",
    ),
    "fal-ai/hyper3d/rodin": _Endpoint(
        {
            "prompt": text(1024),
            "input_image_urls": _pictures,
            "condition_mode": one_of("fuse", "concat"),
            "seed": whole(0, 65535),
            "geometry_file_format": one_of("glb", "usdz", "fbx", "obj", "stl"),
        },
        (),
        "model_mesh",
    ),
    "fal-ai/hunyuan3d-v3/text-to-3d": _Endpoint({"prompt": text(1024)}, ("prompt",), "model_glb"),
    "fal-ai/flux/dev": _Endpoint(
        {"prompt": text(4096), "seed": whole(0, 2**31 - 1), "num_images": whole(1, 4), "image_size": text(64)},
        ("prompt",),
        IMAGES,
    ),
}


@dataclass
class _Request:
    id: str
    endpoint: str
    body: Any
    polls_left: int
    seed: int
    never_ends: bool
    fails: bool = False
    status: str = "IN_QUEUE"


class FakeFal(FakeVendor):
    """fal's queue on this machine; a request completes after ``polls`` status requests.

    ``names`` overrides URLs in the reply to a submission, to simulate a reply that leads to another host.
    """

    refusals = REFUSALS

    def __init__(self, faults: Faults | None = None, key: str = "rehearsal-key", polls: int = 2):
        super().__init__(faults, key, polls)
        self.names: dict[str, str] = {}
        self._requests: dict[str, _Request] = {}

    def __repr__(self) -> str:
        return f"FakeFal({len(self._requests)} requests)"

    @property
    def submitted(self) -> int:
        """Number of accepted, and so charged, requests."""
        return len(self._requests)

    def authorization(self) -> str:
        """Return the authorization header with the key."""
        return f"Key {self.key}"

    def seed_of(self, job: str) -> int | None:
        """Return the seed of a request's mesh; None for an unknown request."""
        return self._requests[job].seed if job in self._requests else None

    def api(self, request: Request, base_url: str) -> Response:
        """Answer an authorized request."""
        place = request.path.strip("/")
        if request.method == "POST":
            return self._submit(request, place, base_url)
        app, _, rest = place.partition("/requests/")
        id, _, what = rest.partition("/")
        asked = self._requests.get(id)
        if request.method != "GET" or asked is None or app != _app(asked.endpoint) or what not in ("", "status"):
            return Response(404, {"detail": "Not found"})
        return self._status(asked, base_url) if what else self._result(asked, base_url)

    def _submit(self, request: Request, endpoint: str, base_url: str) -> Response:
        if endpoint not in ENDPOINTS:
            return Response(404, {"detail": f"Application '{endpoint}' not found"})
        try:
            body = request.json()
        except ValueError:
            return Response(400, {"detail": "The body is not JSON"})
        number = len(self._requests) + 1
        never_ends = self.faults.strike("job_never_ends")
        asked = _Request(f"764cabcf-b745-4b3e-ae38-{number:012x}", endpoint, body, self.polls, number, never_ends)
        self._requests[asked.id] = asked
        own = self._addresses(asked, base_url)
        return Response(200, {"status": "IN_QUEUE", "request_id": asked.id, "queue_position": 0, **own, **self.names})

    def _addresses(self, asked: _Request, base_url: str) -> dict[str, str]:
        place = f"{base_url}/{_app(asked.endpoint)}/requests/{asked.id}"
        return {"response_url": place, "status_url": f"{place}/status", "cancel_url": f"{place}/cancel"}

    def _status(self, asked: _Request, base_url: str) -> Response:
        if asked.status != "COMPLETED" and not asked.never_ends:
            asked.polls_left -= 1
            if asked.polls_left <= 0:
                asked.status, asked.fails = "COMPLETED", self.faults.strike("job_fails")
        elif asked.never_ends:
            asked.status = "IN_PROGRESS"
        body = {"status": asked.status, "request_id": asked.id, **self._addresses(asked, base_url)}
        if asked.status == "COMPLETED":
            return Response(200, body)
        waiting = {"queue_position": 0} if asked.status == "IN_QUEUE" else {"logs": None}
        asked.status = "IN_PROGRESS"
        return Response(202, {**body, **waiting})

    def _result(self, asked: _Request, base_url: str) -> Response:
        if asked.status != "COMPLETED":
            return Response(400, {"detail": "Request is still in progress"})
        endpoint = ENDPOINTS[asked.endpoint]
        wrong = complaint(asked.body, endpoint.fields, endpoint.required)
        if wrong:
            return Response(422, {"detail": [{"loc": ["body", wrong[0]], "msg": wrong[1], "type": "value_error"}]})
        if asked.fails:
            problem = {"loc": ["body"], "msg": "No object was found in the picture", "type": "generation_error"}
            return Response(422, {"detail": [problem]})
        if endpoint.output == IMAGES:
            drawn = {"url": f"{base_url}{FILES}{asked.id}/picture.png", "content_type": "image/png", "width": 128}
            return Response(200, {IMAGES: [drawn], "seed": asked.seed, "has_nsfw_concepts": [False]})
        link = f"{base_url}{FILES}{asked.id}/model.glb"
        made = {"url": link, "content_type": "model/gltf-binary", "file_name": "model.glb", "file_size": 1}
        return Response(200, {"timings": {"prepare": 0.1, "generation": 3.0}, endpoint.output: made})


def _app(endpoint: str) -> str:
    return "/".join(endpoint.split("/")[:2])
