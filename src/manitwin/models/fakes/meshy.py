"""Fake server of the Meshy API: image-to-3d, text-to-3d in two steps, balance.

Fields, states and error bodies: https://docs.meshy.ai/api/text-to-3d, .../api/image-to-3d, .../api/errors and .../api/balance,
read 2026-11. Undocumented, and assumed here: the refusal of unknown fields (400), the texts of the error messages, and the
credits that an image costs. Expired file links give 403, like those of a CDN.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.json_fields import complaint, flag, list_of, one_of, picture_url, text, whole
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import FILES, FakeVendor

IMAGE, TEXT, BALANCE = "/openapi/v1/image-to-3d", "/openapi/v2/text-to-3d", "/openapi/v1/balance"
MODELS = ("latest", "meshy-5", "meshy-6")
FORMATS = ("glb", "obj", "fbx", "stl", "usdz", "3mf")
LONGEST_TEXT = 600
LARGEST_PAGE = 50
FIRST_MS = 1_760_000_000_000
CREDITS = {"image-to-3d": 30, "text-to-3d-preview": 20, "text-to-3d-refine": 10}

SHAPE = {
    "ai_model": one_of(*MODELS),
    "model_type": one_of("standard", "lowpoly"),
    "topology": one_of("quad", "triangle"),
    "target_polycount": whole(100, 300_000),
    "symmetry_mode": one_of("off", "auto", "on"),
    "should_remesh": flag,
    "pose_mode": one_of("a-pose", "t-pose", ""),
}
ANY = {
    "moderation": flag,
    "target_formats": list_of(*FORMATS),
    "auto_size": flag,
    "origin_at": one_of("bottom", "center"),
}
TEXTURE = {
    "enable_pbr": flag,
    "hd_texture": flag,
    "texture_prompt": text(LONGEST_TEXT),
    "texture_image_url": picture_url,
    "remove_lighting": flag,
}
IMAGE_FIELDS = {"image_url": picture_url, "should_texture": flag, **SHAPE, **ANY, **TEXTURE}
PREVIEW_FIELDS = {"mode": one_of("preview"), "prompt": text(LONGEST_TEXT), **SHAPE, **ANY}
REFINE_FIELDS = {
    "mode": one_of("refine"),
    "preview_task_id": text(100),
    "ai_model": one_of(*MODELS),
    **ANY,
    **TEXTURE,
}
REFUSALS = {
    "unauthorized": (401, {"message": "Invalid API key"}),
    "out_of_credit": (402, {"message": "Insufficient funds"}),
    "rate_limited": (429, {"message": "Too many requests"}),
    "server_error": (500, {"message": "Internal server error"}),
}


@dataclass
class _Task:
    id: str
    type: str
    body: dict[str, Any]
    created_ms: int
    polls_left: int
    seed: int
    never_ends: bool
    status: str = "PENDING"
    finished_ms: int = 0
    links: int = 0


class FakeMeshy(FakeVendor):
    """Meshy on this machine; a task completes after ``polls`` status requests and costs ``CREDITS`` of ``balance``."""

    refusals = REFUSALS

    def __init__(self, faults: Faults | None = None, key: str = "rehearsal-key", polls: int = 2, balance: int = 1000):
        super().__init__(faults, key, polls)
        self.balance = balance
        self._tasks: dict[str, _Task] = {}
        self._now_ms = FIRST_MS

    def __repr__(self) -> str:
        return f"FakeMeshy({len(self._tasks)} tasks)"

    def submitted(self, type: str) -> int:
        """Return the number of accepted, and so charged, tasks of a type."""
        return sum(task.type == type for task in self._tasks.values())

    def seed_of(self, job: str) -> int | None:
        """Return the seed of a task's mesh; None for an unknown task."""
        return self._tasks[job].seed if job in self._tasks else None

    def api(self, request: Request, base_url: str) -> Response:
        """Answer an authorized request."""
        where = (request.method, request.path)
        if where == ("GET", BALANCE):
            return Response(200, {"balance": self.balance})
        if where in (("POST", IMAGE), ("POST", TEXT)):
            return self._submit(request)
        if where == ("GET", TEXT):
            return self._list(request, base_url)
        if request.method == "GET" and request.path.rpartition("/")[0] in (IMAGE, TEXT):
            return self._look(request.path, base_url)
        return _message(404, "Not found")

    def _submit(self, request: Request) -> Response:
        try:
            body = request.json()
        except ValueError:
            return _message(400, "The body is not JSON")
        kind, fields = "image-to-3d", IMAGE_FIELDS
        required: tuple[str, ...] = ("image_url",)
        if request.path == TEXT:
            refine = isinstance(body, dict) and body.get("mode") == "refine"
            kind = "text-to-3d-refine" if refine else "text-to-3d-preview"
            fields = REFINE_FIELDS if refine else PREVIEW_FIELDS
            required = ("mode", "preview_task_id" if refine else "prompt")
        wrong = complaint(body, fields, required)
        if wrong:
            return _message(400, f"{wrong[0]} {wrong[1]}")
        if kind == "text-to-3d-refine":
            preview = self._tasks.get(body["preview_task_id"])
            if preview is None or preview.type != "text-to-3d-preview":
                return _message(404, "Preview task not found")
            if preview.status != "SUCCEEDED":
                return _message(400, "The preview task has not succeeded yet")
        if self.balance < CREDITS[kind]:
            return Response(*REFUSALS["out_of_credit"])
        self.balance -= CREDITS[kind]
        number = len(self._tasks) + 1
        never_ends = self.faults.strike("job_never_ends")
        task = _Task(f"018a210d-8ba4-705c-b111-{number:012x}", kind, body, self._tick(), self.polls, number, never_ends)
        self._tasks[task.id] = task
        return Response(202, {"result": task.id})

    def _look(self, path: str, base_url: str) -> Response:
        folder, _, id = path.rpartition("/")
        task = self._tasks.get(id)
        if task is None or (folder == IMAGE) != (task.type == "image-to-3d"):
            return _message(404, "Task not found")
        if task.status in ("PENDING", "IN_PROGRESS") and not task.never_ends:
            task.polls_left -= 1
            if task.polls_left <= 0:
                task.finished_ms = self._tick()
                task.status = "FAILED" if self.faults.strike("job_fails") else "SUCCEEDED"
                return Response(200, self._object(task, base_url))
        if task.status == "PENDING":
            task.status = "IN_PROGRESS"
        return Response(200, self._object(task, base_url))

    def _list(self, request: Request, base_url: str) -> Response:
        query = request.query
        page, size = query.get("page_num", "1"), query.get("page_size", "10")
        order = query.get("sort_by", "-created_at").replace(" ", "+")
        if not (page.isdigit() and size.isdigit() and int(page) >= 1 and 1 <= int(size) <= LARGEST_PAGE):
            return _message(400, "page_num or page_size is out of range")
        if order not in ("+created_at", "-created_at"):
            return _message(400, "sort_by must be +created_at or -created_at")
        tasks = [task for task in self._tasks.values() if task.type != "image-to-3d"]
        tasks.sort(key=lambda task: task.created_ms, reverse=order.startswith("-"))
        first = (int(page) - 1) * int(size)
        return Response(200, [self._object(task, base_url) for task in tasks[first : first + int(size)]])

    def _object(self, task: _Task, base_url: str) -> dict[str, Any]:
        done = task.status == "SUCCEEDED"
        task.links += done
        link = f"{base_url}{FILES}{task.id}/model.glb?Expires={FIRST_MS + task.links}"
        preview = self._tasks.get(task.body.get("preview_task_id", ""), task)
        return {
            "id": task.id,
            "type": task.type,
            "model_urls": {"glb": link} if done else {},
            "thumbnail_url": "",
            "prompt": preview.body.get("prompt", ""),
            "texture_prompt": task.body.get("texture_prompt", ""),
            "progress": 100 if done else 0 if task.status == "PENDING" else 50,
            "created_at": task.created_ms,
            "started_at": 0 if task.status == "PENDING" else task.created_ms,
            "finished_at": task.finished_ms,
            "status": task.status,
            "texture_urls": [],
            "preceding_tasks": 0,
            "task_error": {"message": "The mesh could not be made" if task.status == "FAILED" else ""},
            "consumed_credits": CREDITS[task.type] if done else 0,
        }

    def _tick(self) -> int:
        self._now_ms += 1000
        return self._now_ms


def _message(status: int, words: str) -> Response:
    return Response(status, {"message": words})
