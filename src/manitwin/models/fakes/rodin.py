"""Fake of the Rodin API by Hyper3D.

Contract: developer.hyper3d.ai, api-specification/* (Gen-1 & 1.5, Gen-2, Gen-2.5, check-status, download-results, check-balance),
pages as stored in November 2026 at the latest, and the vendor's own client DeemosTech/rodin3d-skills. Unverified: the HTTP status
of refusals other than 401 (400 here), and the answer for an unknown task (404 here).
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import FILES, FakeVendor

PREFIX = "/api/v2"
GEN_1 = ("Sketch", "Regular", "Detail", "Smooth")
GEN_2_5 = tuple(f"Gen-2.5-{level}" for level in ("Extreme-Low", "Low", "Medium", "High", "Extreme-High"))
BOOLEAN = ("true", "false")
ENUMS = {
    "tier": (*GEN_1, "Gen-2", *GEN_2_5),
    "geometry_file_format": ("glb", "usdz", "fbx", "obj", "stl"),
    "material": ("PBR", "Shaded", "All", "None"),
    "quality": ("high", "medium", "low", "extra-low"),
    "mesh_mode": ("Raw", "Quad"),
    "condition_mode": ("concat", "fuse"),
    "texture_mode": ("legacy", "extreme-low", "low", "medium", "high"),
    "geometry_instruct_mode": ("faithful", "creative"),
    "addons": ("HighPack",),
    **dict.fromkeys(("use_original_alpha", "TAPose", "preview_render", "hd_texture", "texture_delight"), BOOLEAN),
    **dict.fromkeys(("is_micro", "mesh_simplify", "mesh_smooth"), BOOLEAN),
}
ONLY_FOR = {
    "condition_mode": GEN_1,
    "mesh_simplify": GEN_1,
    "mesh_smooth": GEN_1,
    "texture_mode": GEN_2_5,
    "texture_delight": GEN_2_5,
    "geometry_instruct_mode": GEN_2_5,
    "image_label": GEN_2_5,
    "hd_texture": ("Gen-2", *GEN_2_5),
    "is_micro": ("Gen-2.5-Extreme-High",),
}
RANGES = {"seed": (0, 65535), "quality_override": (500, 2_000_000)}
FREE_TEXT = ("prompt", "bbox_condition", "image_label")
MAX_IMAGES = 5
REFUSALS = {
    "unauthorized": (401, {"error": "UNAUTHORIZED", "message": "Active API key is required."}),
    "rate_limited": (429, {"error": "TOO_MANY_REQUESTS", "message": "slow down"}),
    "server_error": (500, {"error": "UNKNOWN", "message": "Internal server error"}),
}


@dataclass
class RodinTask:
    """A task: its form, images and number of polls."""

    form: dict[str, str]
    images: list[bytes]
    polls: int = 0


class FakeRodin(FakeVendor):
    """Rodin on this machine; ``tasks`` are the accepted tasks in order, each charged half a credit.

    A task is Waiting at the first poll, Generating until the ``polls``-th, then Done. The base URL is ``.url + "/api/v2"``.
    """

    refusals = REFUSALS

    def __init__(
        self, faults: Faults | None = None, key: str = "rehearsal-key", *, credits: float = 12, polls: int = 3
    ):
        super().__init__(faults, key, polls)
        self.credits = credits
        self.tasks: dict[str, RodinTask] = {}
        self._links = 0

    def seed_of(self, job: str) -> int | None:
        """Return the seed of a task's mesh; None for an unknown task."""
        return int(self.tasks[job].form.get("seed", "0")) if job in self.tasks else None

    def api(self, request: Request, base_url: str) -> Response:
        """Answer an authorized request."""
        if (request.method, request.path) == ("GET", f"{PREFIX}/check_balance"):
            return Response(200, {"balance": self.credits})
        if request.method != "POST":
            return _error(404, "INVALID_REQUEST", f"no {request.method} {request.path}")
        if request.path == f"{PREFIX}/rodin":
            return self._submit(request)
        try:
            body = request.json()
        except ValueError:
            return _error(400, "INVALID_REQUEST", "the body is no JSON")
        if request.path == f"{PREFIX}/status":
            return self._status(body)
        if request.path == f"{PREFIX}/download":
            return self._download(body, base_url)
        return _error(404, "INVALID_REQUEST", f"no POST {request.path}")

    def _submit(self, request: Request) -> Response:
        try:
            parts = request.form()
        except ValueError as error:
            return _error(400, "INVALID_REQUEST", str(error))
        images = [content for name, filename, content in parts if name == "images" and filename]
        form = {name: content.decode() for name, filename, content in parts if not filename}
        wrong = _wrong(form, images)
        if wrong:
            return _error(400, "INVALID_REQUEST", wrong)
        if self.faults.strike("out_of_credit") or self.credits < 0.5:
            return _error(400, "INSUFFICIENT_FUND", "The account balance is insufficient.")
        self.credits -= 0.5
        number = len(self.tasks)
        task = f"00000000-0000-4000-8000-{number:012d}"
        self.tasks[task] = RodinTask(form, images)
        jobs = {"uuids": [f"{task}-geometry", f"{task}-texture"], "subscription_key": f"subscription-{number}"}
        return Response(201, {"error": None, "message": "Submitted.", "uuid": task, "jobs": jobs})

    def _status(self, body: Any) -> Response:
        key = body.get("subscription_key") if isinstance(body, dict) else None
        named = [task for number, task in enumerate(self.tasks) if f"subscription-{number}" == key]
        if not named or self.faults.strike("job_lost"):
            return _error(404, "INVALID_REQUEST", "unknown subscription_key")
        task = self.tasks[named[0]]
        task.polls += 1
        if self.faults.strike("job_fails"):
            states = ("Done", "Failed")
        elif task.polls == 1:
            states = ("Waiting", "Waiting")
        elif task.polls < self.polls or self.faults.strike("job_never_ends"):
            states = ("Done", "Generating")
        else:
            states = ("Done", "Done")
        names = ("geometry", "texture")
        jobs = [{"uuid": f"{named[0]}-{name}", "status": state} for name, state in zip(names, states, strict=True)]
        return Response(201, {"error": "OK", "jobs": jobs})

    def _download(self, body: Any, base_url: str) -> Response:
        name = body.get("task_uuid") if isinstance(body, dict) else None
        if name not in self.tasks:
            return _error(404, "INVALID_REQUEST", "unknown task_uuid")
        task = self.tasks[name]
        if task.polls < self.polls:
            return Response(201, {"error": "OK", "list": []})
        self._links += 1
        suffix = task.form.get("geometry_file_format", "glb")
        files = ("preview.webp", f"model.{suffix}")
        links = [{"url": f"{base_url}{FILES}{name}/{file}?signature={self._links}", "name": file} for file in files]
        return Response(201, {"error": "OK", "list": links})


def _error(status: int, code: str, message: str) -> Response:
    return Response(status, {"error": code, "message": message})


def _wrong(form: dict[str, str], images: list[bytes]) -> str | None:
    """Return the error message for a form; None if it is valid."""
    for name, value in form.items():
        if name not in (*ENUMS, *RANGES, *FREE_TEXT):
            return f"unknown field {name}"
        if name in ENUMS and value not in ENUMS[name]:
            return f"{name} is {value!r}, not one of {', '.join(ENUMS[name])}"
        if name in RANGES and not (value.isdigit() and RANGES[name][0] <= int(value) <= RANGES[name][1]):
            return f"{name} is {value!r}, not from {RANGES[name][0]} to {RANGES[name][1]}"
    tier = form.get("tier", "Regular")
    misplaced = [name for name in form if tier not in ONLY_FOR.get(name, (tier,))]
    if misplaced:
        return f"{misplaced[0]} is not for tier {tier}"
    if tier == "Sketch" and form.get("geometry_file_format", "glb") != "glb":
        return "Sketch makes glb only"
    if len(images) > MAX_IMAGES:
        return f"{len(images)} images, at most {MAX_IMAGES}"
    if not images and not form.get("prompt"):
        return "give images or a prompt"
    if any(not image.startswith((b"\x89PNG", b"\xff\xd8", b"RIFF")) for image in images):
        return "an image is neither PNG, JPEG nor WebP"
    return _wrong_box(form.get("bbox_condition"))


def _wrong_box(text: str | None) -> str | None:
    if text is None:
        return None
    try:
        box = json.loads(text)
    except ValueError:
        return "bbox_condition is no JSON"
    fits = isinstance(box, list) and len(box) == 3 and all(isinstance(side, int) for side in box)
    return None if fits else "bbox_condition is not three integers"
