"""The generator ``hunyuan3d``: a self-hosted server of Hunyuan3D's own ``api_server.py``, version 2.0 or 2.1.

API: github.com/Tencent-Hunyuan/Hunyuan3D-2, api_server.py at 9cc41a37; github.com/Tencent-Hunyuan/Hunyuan3D-2.1,
api_server.py at 0406efee and api_models.py at 4ebf83bc. The sources were read, not run. No key, no price.

``/send`` and ``/status`` report no failures and, in 2.1, do not report that an untextured mesh is finished; ``/generate``
answers when the mesh is finished and reports failures. Therefore a job uses ``/send`` where completion is reported (2.0
untextured, 2.1 textured), otherwise ``/generate``.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from manitwin.config import BuildConfig, Resource
from manitwin.errors import BadReply, ConfigError, Unavailable, Unsupported, unknown_name_message
from manitwin.formats.image_file import png_of
from manitwin.models.generators.protocol import Asked, Generated, GenerationRequest, JobState
from manitwin.models.generators.vendor import submit_paid
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import split_url
from manitwin.models.services.refusal import NotFound, Refusal, refusal_by_status

VENDOR = "http://localhost:8081"  # default port of api_server.py
VERSION = "2.1"
OPTIONS = {
    "2.0": ("texture", "octree_resolution", "num_inference_steps", "guidance_scale", "face_count"),
    "2.1": ("texture", "octree_resolution", "num_inference_steps", "guidance_scale", "face_count", "num_chunks"),
}
SEEDS = 2**32
MAX_ANSWER_BYTES = 384 << 20  # a mesh of 288 MiB in base64, held in memory, twice while it is parsed
PENDING_STATES = {"processing": "running", "texturing": "running"}


class Hunyuan3dGenerator:
    """Make meshes with a Hunyuan3D server, textured unless ``generate.options.texture`` is false.

    A job of ``/send`` survives a restart of this process; if it failed at the server, it appears to be running until
    ``generate.max_wait_s``. A job of ``/generate`` is finished when ``submit`` returns, and lives as long as this object.
    """

    name = "hunyuan3d"
    needs: Resource = "generator"
    asked_with: frozenset[Asked] = frozenset({"image"})

    def __init__(self, version: str, base_url: str, config: BuildConfig, sleep: Callable[[float], None] = time.sleep):
        if version not in OPTIONS:
            raise ConfigError(f"hunyuan3d: {unknown_name_message('version', version, OPTIONS)}")
        for option in config.generate.options:
            if option not in OPTIONS[version]:
                raise ConfigError(f"generate.options: {unknown_name_message('option', option, OPTIONS[version])}")
        self.version = version
        self.model: str | None = f"Hunyuan3D {version}"
        self.usd_per_job = config.services.usd_per_job or 0.0
        self._options: dict[str, Any] = {"texture": True, **config.generate.options}
        self._service = self._http_service(base_url, config, config.services.timeout_s, sleep)
        self._patient = self._http_service(base_url, config, config.generate.max_wait_s, sleep)
        self._made: dict[str, bytes] = {}

    def __repr__(self) -> str:
        return f"Hunyuan3dGenerator({self.version!r}, {self._service.base_url!r})"

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> Hunyuan3dGenerator:
        """Create the generator from ``2.0@URL`` or ``2.1@URL``; version and URL are optional."""
        version, url = split_url(argument)
        return cls(version or VERSION, url or VENDOR, config)

    def probe(self) -> str:
        """Query the health of a 2.1 server; a 2.0 server has no health check and is asked for the status of an unknown job."""
        if self.version == "2.1":
            status = self._service.get_json("/health").get("status")
            if status != "healthy":
                raise Unavailable(f"hunyuan3d: its health is {self._service.said(str(status))!r}; look at its log")
            return "the server is healthy"
        self._status("none")
        return "the server answers"

    def submit(self, request: GenerationRequest) -> str:
        """Submit a picture; raises Unsupported for a text, which neither server version takes."""
        if request.rgba is None:
            raise Unsupported(
                f"hunyuan3d cannot make a mesh from text ({request.text!r}): its server loads no text model;"
                " give a photo, or choose another generator"
            )
        body = {"image": base64.b64encode(png_of(request.rgba)).decode(), "seed": request.seed % SEEDS, **self._options}
        if self.version == "2.0":
            body["type"] = "glb"
        else:
            body["remove_background"] = False  # the photo is already matted
        told_when_done = bool(self._options["texture"]) == (self.version == "2.1")
        return self._send(body) if told_when_done else self._generate(body)

    def poll(self, job_id: str) -> JobState:
        """Return the state of a job; raises Gone for a ``/generate`` job of another process."""
        how, uid = self._split_job_id(job_id)
        if how == "generate" or job_id in self._made:
            return JobState("done")
        answer = self._status(uid)
        status = answer.get("status")
        if status == "completed":
            self._made[job_id] = _mesh_bytes(answer)
            return JobState("done")
        if status == "error":  # a state of forks; the servers above do not have it
            return JobState("failed", self._service.said(str(answer.get("message") or "")))
        if not isinstance(status, str) or status not in PENDING_STATES:
            raise BadReply(
                f"hunyuan3d: job {self._service.said(uid)} has the unknown status {self._service.said(str(status))!r}"
            )
        return JobState("running")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Write the GLB into ``folder``."""
        how, uid = self._split_job_id(job_id)
        if how == "send" and job_id not in self._made:
            self._made[job_id] = _mesh_bytes(self._status(uid))
        path = folder / "generated.glb"
        path.write_bytes(self._made.pop(job_id))
        return Generated(path, self.model, {"textured": bool(self._options["texture"])})

    def _send(self, body: Mapping[str, Any]) -> str:
        return f"send:{submit_paid(self._service, '/send', body, ('uid',))['uid']}"

    def _generate(self, body: Mapping[str, Any]) -> str:
        made = self._patient.ask("POST", "/generate", body=body, pays=True, max_bytes=MAX_ANSWER_BYTES)
        # derived from the request, so that a job of another process cannot be mistaken for this one
        job_id = f"generate:{hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()[:32]}"
        self._made[job_id] = made
        return job_id

    def _status(self, uid: str) -> dict[str, Any]:
        return self._service.get_json(f"/status/{quote(uid, safe='')}", max_bytes=MAX_ANSWER_BYTES)

    def _split_job_id(self, job_id: str) -> tuple[str, str]:
        how, _, uid = job_id.partition(":")
        if how not in ("send", "generate") or not uid:
            raise BadReply(f"hunyuan3d: {job_id!r} is not a job id of this generator; run it again")
        if how == "generate" and job_id not in self._made:
            raise NotFound(f"hunyuan3d: job {job_id} ended with the process that began it; run it again")
        return how, uid

    def _http_service(
        self, base_url: str, config: BuildConfig, timeout_s: float, sleep: Callable[[float], None]
    ) -> HttpService:
        services = config.services.model_copy(update={"timeout_s": timeout_s})
        return HttpService(
            "hunyuan3d", base_url, authorization={}, services=services, key=None, refusal=_refusal, sleep=sleep
        )


def _refusal(status: int, body: Any) -> Refusal | None:
    """Read a refusal; every failed job is a 404 with the same message (api_server.py, ``generate``)."""
    if status == 404 and isinstance(body, Mapping) and "error_code" in body:
        return Refusal(
            f"the job failed, and the server says only {str(body.get('text'))[:80]!r}; its own log says why. A texture needs"
            " about 16 GB of GPU memory and, in 2.0, --enable_tex: without, set generate.options.texture = false",
            "bad",
        )
    if status == 404:
        return Refusal("it has no such address; check its URL, and that it is the version that was named", "bad")
    return refusal_by_status(status, body)


def _mesh_bytes(answer: Mapping[str, Any]) -> bytes:
    model = answer.get("model_base64")
    if answer.get("status") != "completed" or not isinstance(model, str):
        raise BadReply("hunyuan3d: its answer has no 'model_base64'")
    try:
        return base64.b64decode(model, validate=True)
    except (binascii.Error, ValueError) as error:
        raise BadReply(f"hunyuan3d: its 'model_base64' is no base64: {error}") from error
