"""Fake of Hunyuan3D's own ``api_server.py``, version 2.0 or 2.1, with its pitfalls.

2.0: github.com/Tencent-Hunyuan/Hunyuan3D-2, api_server.py at 9cc41a37; 2.1: github.com/Tencent-Hunyuan/Hunyuan3D-2.1,
api_server.py at 0406efee, api_models.py at 4ebf83bc, model_worker.py at 024fd427. Neither requires a key nor rejects unknown
fields. Every failure of ``/generate`` is a 404 with the same message; a failed ``/send`` is never reported; 2.1 reports
``completed`` for textured meshes only.
"""

from __future__ import annotations

import base64
import threading
from dataclasses import dataclass, field
from typing import Any, Literal

from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.json_fields import Check, flag, number, picture_base64, whole
from manitwin.models.fakes.meshes import mesh_file
from manitwin.models.fakes.server import Request, Response
from manitwin.models.fakes.vendor import with_outages

SAID_OF_ANY_FAILURE = "**NETWORK ERROR DUE TO HIGH TRAFFIC. PLEASE REGENERATE OR REFRESH THIS PAGE.**"
FIELDS_2_1: dict[str, Check] = {
    "image": lambda value: None if isinstance(value, str) else "Input should be a valid string",
    "remove_background": flag,
    "texture": flag,
    "seed": whole(0, 2**32 - 1),
    "octree_resolution": whole(64, 512),
    "num_inference_steps": whole(1, 20),
    "guidance_scale": number(0.1, 20.0),
    "num_chunks": whole(1000, 20_000),
    "face_count": whole(1000, 100_000),
}
REFUSALS: dict[str, tuple[int, Any]] = {"server_error": (500, b"Internal Server Error")}


@dataclass
class _Job:
    body: dict[str, Any]
    crashed: bool
    seed: int
    looks: int = 0


@dataclass
class FakeHunyuan3d:
    """A Hunyuan3D server on this machine; a job completes after ``polls`` status requests.

    ``enable_tex`` is the flag of the 2.0 server; without it, texture requests fail.
    """

    faults: Faults = field(default_factory=Faults)
    version: Literal["2.0", "2.1"] = "2.1"
    enable_tex: bool = False
    polls: int = 2
    _jobs: dict[str, _Job] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def sent(self) -> int:
        """Number of jobs accepted by ``/send`` or ``/generate``."""
        return len(self._jobs)

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request like api_server.py."""
        return with_outages(self.faults, REFUSALS, lambda: self._api(request))

    def _api(self, request: Request) -> Response:
        with self._lock:  # a job blocks the server's only event loop, so requests are serialized
            if request.method == "POST" and request.path in ("/generate", "/send"):
                return self._accept_job(request)
            if request.method == "GET" and request.path.startswith("/status/"):
                return self._status(request.path.removeprefix("/status/"))
            if (request.method, request.path, self.version) == ("GET", "/health", "2.1"):
                return Response(200, {"status": "healthy", "worker_id": "abc123"})
            return Response(404, {"detail": "Not Found"})

    def _accept_job(self, request: Request) -> Response:
        try:
            body = request.json()
        except ValueError:
            return (
                _invalid("body", "JSON decode error") if self.version == "2.1" else Response(*REFUSALS["server_error"])
            )
        if self.version == "2.1" and (wrong := _wrong_2_1(body)):
            return _invalid(*wrong)
        crashed = self._crashes(body) or self.faults.strike("job_fails")
        number = len(self._jobs) + 1
        uid = f"3f2b8a6e-0000-4000-8000-{number:012x}"
        self._jobs[uid] = _Job(body, crashed, number)
        if request.path == "/send":
            return Response(200, {"uid": uid})
        if crashed:
            return Response(404, {"text": SAID_OF_ANY_FAILURE, "error_code": 1})
        return Response(200, mesh_file("glb", self.faults, number), {"Content-Type": "application/octet-stream"})

    def _crashes(self, body: dict[str, Any]) -> bool:
        if picture_base64(body.get("image")):  # also for a text alone: the text pipeline is not loaded
            return True
        return self.version == "2.0" and bool(body.get("texture")) and not self.enable_tex

    def _status(self, uid: str) -> Response:
        job = self._jobs.get(uid)
        if job is None or job.crashed or self.faults.strike("job_never_ends"):
            return Response(200, {"status": "processing"})
        job.looks += 1
        if job.looks < self.polls:
            return Response(200, {"status": "processing"})
        if self.version == "2.1" and (not job.body.get("texture") or job.looks == self.polls):
            return Response(200, {"status": "texturing"})
        if self.version == "2.0" and job.body.get("type", "glb") != "glb":
            return Response(200, {"status": "processing"})
        model = base64.b64encode(mesh_file("glb", self.faults, job.seed)).decode()
        initial = {"initial_model_base64": model} if self.version == "2.1" else {}
        return Response(200, {"status": "completed", "model_base64": model, **initial})


def _wrong_2_1(body: Any) -> tuple[str, str] | None:
    if not isinstance(body, dict):
        return "body", "Input should be a valid dictionary"
    if "image" not in body:
        return "image", "Field required"
    for name, check in FIELDS_2_1.items():
        if name in body and (wrong := check(body[name])):
            return name, wrong
    return None


def _invalid(name: str, words: str) -> Response:
    return Response(422, {"detail": [{"type": "value_error", "loc": ["body", name], "msg": words}]})
