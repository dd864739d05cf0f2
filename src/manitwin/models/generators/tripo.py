"""Tripo (VAST): ``tripo``, ``tripo:MODEL_VERSION``, ``tripo:MODEL_VERSION@URL``; version 2 of the vendor's API.

API: docs.tripo3d.ai (get-started/errors-and-error-handling, other/support-faq, model-generation, file-upload) and the
vendor's own client VAST-AI-Research/tripo-python-sdk be675df, as archived up to November 2026. Verified there: fields,
states, error codes and their HTTP statuses, links that expire after five minutes, failed tasks that cost nothing. Two paths
for uploads are documented, ``/upload`` (the vendor's client) and ``/upload/sts`` (its pages): the first is used. Not
verified: how the alpha channel of a picture is used. Version 3 of the API is not used.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from manitwin.config import BuildConfig
from manitwin.errors import BadReply, ConfigError
from manitwin.formats.image_file import png_of
from manitwin.models.generators.protocol import Generated, GenerationRequest, JobState
from manitwin.models.generators.vendor import VendorGenerator, checked_address, is_name, plausible_number
from manitwin.models.services.http import FormFile
from manitwin.models.services.refusal import NotFound, Refusal, kind_of_status, refusal_by_status

URL = "https://api.tripo3d.ai/v2/openapi"
KEYS = ("TRIPO_API_KEY",)
DEFAULT_MODEL = "v2.5-20250123"
SEEDS = 1 << 31
# these options produce FBX files, quantised meshes, and meshes without textures
UNREADABLE_OPTIONS = ("quad", "compress", "generate_parts")
# docs.tripo3d.ai/get-started/pricing.html, as archived in November 2026: image to textured model (a text costs 10 credits
# less); "H2 / H3" there are the versions v2 and v3. $1 is 100 credits.
CREDITS = {"v2.": 30, "v3.": 30, "P1-": 50}
OPTION_CREDITS = {("texture_quality", "detailed"): 10, ("smart_low_poly", True): 10}
UNPRICED_OPTIONS = ("geometry_quality",)
USD_PER_CREDIT = 0.01
STATES = {"queued": "queued", "running": "running", "success": "done"}
LINKS = ("pbr_model", "model", "base_model")
NO_CREDIT, NO_TASK, REFUSED_INPUT, TOO_MANY = 2010, 2001, 2008, 2000


class TripoGenerator(VendorGenerator):
    """Make textured meshes of an image or a text with Tripo.

    Settings ``generate.options`` are added to the task; with ``auto_size = true`` the mesh is taken to be in true metres. The
    key is TRIPO_API_KEY. Raises ConfigError for options whose meshes cannot be read, and for a missing key or price.
    """

    name = "tripo"
    url, keys = URL, KEYS
    default_model, model_option = DEFAULT_MODEL, "model_version"
    remedy = f"check {' or '.join(KEYS)} (an API key begins with tsk_), and the credits at platform.tripo3d.ai"

    def __init__(
        self, model: str, url: str, key: str | None, config: BuildConfig, sleep: Callable[[float], None] = time.sleep
    ):
        options = {"model_version": model, "texture": True, "pbr": True, **config.generate.options}
        listed_usd = _listed_usd(options) if url == URL else None
        super().__init__(model, url, key, config, sleep, listed_usd=listed_usd, refusal=refusal_of)
        self._options = options
        wrong = [name for name in UNREADABLE_OPTIONS if options.get(name)]
        if wrong:
            raise ConfigError(f"generator tripo: meshes of generate.options.{wrong[0]} cannot be read; leave it out")

    def probe(self) -> str:
        """Query the account's credits."""
        balance = plausible_number(self._data(self._service.get_json("user/balance"), "balance")["balance"])
        if balance is None:
            raise BadReply("tripo: its answer about the balance has no 'balance'")
        return f"{balance:g} credits left"

    def submit(self, request: GenerationRequest) -> str:
        """Upload the picture, if there is one, and start a task."""
        seed = request.seed % SEEDS
        task: dict[str, Any] = {**self._options, "model_seed": seed, "texture_seed": seed}
        if request.rgba is not None:
            picture = FormFile("file", "image.png", png_of(request.rgba), "image/png")
            token = self._data(self._service.post_form("upload", {}, [picture]), "image_token")["image_token"]
            task |= {"type": "image_to_model", "file": {"type": "png", "file_token": token}}
        else:
            task |= {"type": "text_to_model", "prompt": request.text, "image_seed": seed}
        job = self._data(self._service.post_json("task", task, pays=True), "task_id", pays=True)["task_id"]
        if not is_name(job):
            raise self._service.unreadable("task_id", pays=True)
        return str(job)

    def poll(self, job_id: str) -> JobState:
        """Return the state of the task; raises Gone for a task that has expired."""
        task = self._task(job_id)
        status = str(task.get("status"))
        if status in STATES:
            return JobState(STATES[status])  # type: ignore[arg-type]
        if status == "expired":
            raise NotFound("tripo: the task has expired")
        why = [str(task[name]) for name in ("error_code", "error_msg") if task.get(name)]
        if status == "banned":
            why.append("it violates the vendor's content policy")
        return JobState("failed", self._service.said(": ".join([f"the task is {status}", *why])))

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Download the model; links are valid for five minutes and are renewed once."""
        path = folder / "tripo.glb"
        self._service.download(self._link(job_id), path, fresh_url=lambda: self._link(job_id))
        return Generated(path, self.model, metric=bool(self._options.get("auto_size")))

    def _task(self, job_id: str) -> dict[str, Any]:
        return self._data(self._service.get_json(f"task/{quote(job_id, safe='')}"), "status")

    def _data(self, answer: dict[str, Any], name: str, *, pays: bool = False) -> dict[str, Any]:
        data = answer.get("data")
        if not isinstance(data, dict) or name not in data:
            raise self._service.unreadable(name, pays)
        return data

    def _link(self, job_id: str) -> str:
        output = self._task(job_id).get("output")
        links = [output[name] for name in LINKS if output.get(name)] if isinstance(output, dict) else [None]
        return checked_address(next(iter(links), None), "tripo", "model")


def refusal_of(status: int, body: Any) -> Refusal | None:
    """Read Tripo's ``{"code": n, "message": ..., "suggestion": ...}``; code 0 is no error."""
    code = body.get("code") if isinstance(body, dict) else None
    if code in (None, 0):
        return refusal_by_status(status, body)
    message = ": ".join(str(part) for part in (f"error {code}", body.get("message"), body.get("suggestion")) if part)
    kinds = {NO_CREDIT: "denied", NO_TASK: "gone", REFUSED_INPUT: "input", TOO_MANY: "busy"}
    known = kinds.get(code) if isinstance(code, int) else None
    kind = known or (kind_of_status(status) if status >= 400 else "bad")
    return Refusal(message, kind)  # type: ignore[arg-type]


def _listed_usd(options: dict[str, Any]) -> float | None:
    """Return the maximum price of a job with these options by the vendor's list, None if the list does not cover them."""
    credits = next((n for prefix, n in CREDITS.items() if str(options["model_version"]).startswith(prefix)), None)
    if credits is None or any(name in options for name in UNPRICED_OPTIONS):
        return None
    more = sum(n for (name, value), n in OPTION_CREDITS.items() if options.get(name) == value)
    return round((credits + more) * USD_PER_CREDIT, 2)
