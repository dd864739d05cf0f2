"""Fake of the Tripo API v2.

Contract: docs.tripo3d.ai (errors, task, generation and upload pages) and VAST-AI-Research/tripo-python-sdk be675df, as stored in
November 2026 at the latest: error codes with their HTTP statuses, fields, states, links valid for five minutes. Unverified: which
invalid fields give code 1004 (all here).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import FILES, FakeVendor

PREFIX = "/v2/openapi"
VERSIONS = (
    "v3.1-20260211", "v3.0-20250812", "v2.5-20250123", "v2.0-20240919", "v1.4-20240625", "P1-20260311",
    "Turbo-v1.0-20250506",
)  # fmt: skip
FIELDS: dict[str, Any] = {
    "type": ("image_to_model", "text_to_model", "multiview_to_model"),
    "model_version": VERSIONS,
    "texture_quality": ("standard", "detailed"),
    "geometry_quality": ("standard", "detailed"),
    "texture_alignment": ("original_image", "geometry"),
    "orientation": ("default", "align_image"),
    "compress": ("geometry",),
    **dict.fromkeys(("face_limit", "model_seed", "texture_seed", "image_seed"), int),
    **dict.fromkeys(("texture", "pbr", "auto_size", "quad", "generate_parts", "smart_low_poly"), bool),
    **dict.fromkeys(("enable_image_autofix", "export_uv"), bool),
    **dict.fromkeys(("prompt", "negative_prompt"), str),
    "file": dict,
    "files": list,
}
MAX_PROMPT = 1024
CREDITS_PER_TASK = 30
REFUSALS = {
    "unauthorized": (401, {"code": 1002, "message": "Authentication failed", "suggestion": "Check your credentials"}),
    "rate_limited": (429, {"code": 2000, "message": "You have exceeded the limit of generation.", "suggestion": ""}),
    "server_error": (500, {"code": 1001, "message": "Fatal error on server side", "suggestion": "Contact the support"}),
}


@dataclass
class TripoTask:
    """A task: its input and number of polls."""

    input: dict[str, Any]
    polls: int = 0


class FakeTripo(FakeVendor):
    """Tripo on this machine; ``tasks`` are the accepted tasks in order, each charged thirty credits.

    A task is queued at the first poll, running until the ``polls``-th, then success. The base URL is ``.url + "/v2/openapi"``.
    """

    refusals = REFUSALS

    def __init__(self, faults: Faults | None = None, key: str = "rehearsal-key", *, credits: int = 600, polls: int = 3):
        super().__init__(faults, key, polls)
        self.credits = credits
        self.tasks: dict[str, TripoTask] = {}
        self.uploads: dict[str, bytes] = {}
        self._links = 0

    def seed_of(self, job: str) -> int | None:
        """Return the seed of a task's mesh; None for an unknown task."""
        return self.tasks[job].input.get("model_seed", 0) if job in self.tasks else None

    def api(self, request: Request, base_url: str) -> Response:
        """Answer an authorized request."""
        path = request.path.removeprefix(PREFIX)
        if (request.method, path) == ("GET", "/user/balance"):
            return _data({"balance": self.credits, "frozen": 0})
        if request.method == "POST" and path in ("/upload", "/upload/sts"):
            return self._upload(request)
        if (request.method, path) == ("POST", "/task"):
            return self._submit(request)
        if request.method == "GET" and path.startswith("/task/"):
            return self._status(path.removeprefix("/task/"), base_url)
        return _error(404, 1003, f"no {request.method} {request.path}", "")

    def _upload(self, request: Request) -> Response:
        try:
            files = [content for name, filename, content in request.form() if name == "file" and filename]
        except ValueError as error:
            return _error(400, 1003, str(error), "")
        if not files or not files[0]:
            return _error(400, 2003, "The input file is empty.", "Please check if you passed file")
        if not files[0].startswith((b"\x89PNG", b"\xff\xd8", b"RIFF")):
            return _error(400, 2004, "The file type is unsupported.", "")
        token = f"upload-{len(self.uploads)}"
        self.uploads[token] = files[0]
        return _data({"image_token": token})

    def _submit(self, request: Request) -> Response:
        try:
            body = request.json()
        except ValueError:
            return _error(400, 1003, "The request body is malformed", "")
        refusal = self._wrong(body)
        if refusal is not None:
            return refusal
        if self.faults.strike("refusal"):
            return _error(400, 2008, "Task is rejected because the input violates our content policy.", "")
        if self.faults.strike("out_of_credit") or self.credits < CREDITS_PER_TASK:
            return _error(403, 2010, "You need more credits to start a new task.", "Please purchase more credits.")
        self.credits -= CREDITS_PER_TASK
        task = f"task-{len(self.tasks)}"
        self.tasks[task] = TripoTask(body)
        return _data({"task_id": task})

    def _wrong(self, body: Any) -> Response | None:
        if not isinstance(body, dict) or body.get("type") not in FIELDS["type"]:
            return _error(400, 2002, "The task type is unsupported.", "")
        for name, value in body.items():
            rule = FIELDS.get(name)
            wrong_kind = isinstance(rule, type) and type(value) is not rule
            if rule is None or wrong_kind or (isinstance(rule, tuple) and value not in rule):
                code = 2017 if name == "model_version" else 1004
                return _error(400, code, "One or more of your parameter is invalid", f"{name}: {value!r}")
        if body["type"] == "text_to_model" and not 0 < len(body.get("prompt", "")) <= MAX_PROMPT:
            return _error(400, 1004, "One or more of your parameter is invalid", "prompt")
        if body["type"] == "image_to_model":
            file = body.get("file", {})
            if set(file) - {"type", "file_token", "url", "object"} or file.get("file_token") not in self.uploads:
                return _error(404, 2019, "File not found.", "The referenced file does not exist in storage.")
        return None

    def _status(self, name: str, base_url: str) -> Response:
        if name not in self.tasks or self.faults.strike("job_lost"):
            return _error(404, 2001, "Task not found.", "Please check if you passed the correct task id.")
        task = self.tasks[name]
        task.polls += 1
        data: dict[str, Any] = {"task_id": name, "type": task.input["type"], "input": task.input, "output": {}}
        if self.faults.strike("job_fails"):
            return _data({**data, "status": "failed", "progress": 100, "error_code": 1001, "error_msg": "it broke"})
        if task.polls == 1:
            return _data({**data, "status": "queued", "progress": 0, "queuing_num": 1})
        if task.polls < self.polls or self.faults.strike("job_never_ends"):
            return _data({**data, "status": "running", "progress": 50, "running_left_time": 9})
        self._links += 1
        link = f"{base_url}{FILES}{name}/model.glb?signature={self._links}"
        made = "pbr_model" if task.input.get("pbr", True) else "model"
        return _data({**data, "status": "success", "progress": 100, "output": {made: link, "rendered_image": link}})


def _data(data: dict[str, Any]) -> Response:
    return Response(200, {"code": 0, "data": data})


def _error(status: int, code: int, message: str, suggestion: str) -> Response:
    return Response(status, {"code": code, "message": message, "suggestion": suggestion})
