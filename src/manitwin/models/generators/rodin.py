"""Rodin by Hyper3D (Deemos), the product of the paper's CLAY: ``rodin``, ``rodin:TIER``, ``rodin:TIER@URL``.

API: developer.hyper3d.ai, api-specification/{rodin-generation, rodin-gen2.5, check-status, download-results, check-balance},
as archived up to November 2026. Verified there: fields, enums, seed range, states, answers. Not verified: which HTTP status
comes with which error code, the refusal of a task whose data has been deleted (after 7 days), and that ``use_original_alpha``
works for every tier. The codes beyond the vendor's own list (IMAGE_CONTENT_VIOLATION, PARALLELISM_LIMIT_REACHED, the prefix
API_) are those that public clients of the service handle.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from manitwin.config import BuildConfig
from manitwin.errors import BadReply, ConfigError, unknown_name_message
from manitwin.formats.image_file import png_of
from manitwin.models.generators.protocol import Generated, GenerationRequest, JobState
from manitwin.models.generators.vendor import VendorGenerator, checked_address, is_name, plausible_number
from manitwin.models.services.http import FormFile
from manitwin.models.services.refusal import NotFound, Refusal, kind_of_status, refusal_by_status

URL = "https://api.hyper3d.com/api/v2"
KEYS = ("RODIN_API_KEY", "HYPER3D_API_KEY")
TIERS = (
    "Sketch", "Regular", "Detail", "Smooth", "Gen-2", "Gen-2.5-Extreme-Low", "Gen-2.5-Low", "Gen-2.5-Medium",
    "Gen-2.5-High", "Gen-2.5-Extreme-High",
)  # fmt: skip
READABLE_FORMATS = ("glb", "usdz")
SEEDS = 65536
ACCOUNT_ERRORS = {
    "UNAUTHORIZED", "NO_ACTIVE_SUBSCRIPTION", "SUBSCRIPTION_PLAN_TOO_LOW", "INSUFFICIENT_FUND", "USER_NOT_FOUND",
    "GROUP_NOT_FOUND", "PERMISSION_DENIED",
}  # fmt: skip
INPUT_ERRORS = {"IMAGE_CONTENT_VIOLATION", "OBJECT_NOT_FOUND_ON_IMAGE"}


class RodinGenerator(VendorGenerator):
    """Make textured meshes of an image or a text with Rodin.

    Settings ``generate.options`` are passed on as form fields; ``geometry_file_format`` may be glb or usdz (as in the paper).
    The key is RODIN_API_KEY or HYPER3D_API_KEY. Raises ConfigError for an unknown tier or format, and for a missing key or
    price.
    """

    name = "rodin"
    url, keys = URL, KEYS
    default_model, model_option = "Regular", "tier"  # the vendor's own default
    remedy = f"check {' or '.join(KEYS)}, and the plan and credits at hyper3d.ai"

    def __init__(
        self, tier: str, url: str, key: str | None, config: BuildConfig, sleep: Callable[[float], None] = time.sleep
    ):
        if tier not in TIERS:
            raise ConfigError(unknown_name_message("tier of rodin", tier, TIERS))
        super().__init__(tier, url, key, config, sleep, refusal=refusal_of)
        self._fields = {"tier": tier, "geometry_file_format": "glb", "material": "PBR", "mesh_mode": "Raw"}
        self._fields |= {name: _form_value(value) for name, value in self._options.items()}
        self._format = self._fields["geometry_file_format"]
        if self._format not in READABLE_FORMATS:
            raise ConfigError(unknown_name_message("geometry_file_format of rodin", self._format, READABLE_FORMATS))

    def probe(self) -> str:
        """Query the account's credits."""
        balance = plausible_number(self._service.get_json("check_balance").get("balance"))
        if balance is None:
            raise BadReply("rodin: its answer about the balance has no 'balance'")
        return f"{balance:g} credits left"

    def submit(self, request: GenerationRequest) -> str:
        """Start a task and return an id that contains what another process needs to poll and download it."""
        fields = {**self._fields, "seed": str(request.seed % SEEDS)}
        files = []
        if request.rgba is not None:
            fields.setdefault("use_original_alpha", "true")  # the photo is already matted
            files = [FormFile("images", "image.png", png_of(request.rgba), "image/png")]
        elif request.text is not None:
            fields["prompt"] = request.text
        answer = self._service.post_form("rodin", fields, files, pays=True)
        jobs = answer.get("jobs")
        task, subscription = answer.get("uuid"), jobs.get("subscription_key") if isinstance(jobs, dict) else None
        if not is_name(task) or not is_name(subscription):
            raise self._service.unreadable("uuid and subscription_key", pays=True)
        return json.dumps([task, subscription])

    def poll(self, job_id: str) -> JobState:
        """Return done if all jobs of the task are done, failed if one of them failed; the vendor gives no reasons."""
        answer = self._service.post_json("status", {"subscription_key": json.loads(job_id)[1]})
        jobs = answer.get("jobs")
        if not isinstance(jobs, list) or not all(isinstance(job, dict) for job in jobs):
            raise self._service.unreadable("list of jobs")
        states = {str(job.get("status")) for job in jobs}
        if "Failed" in states:
            return JobState("failed", "the job failed; Rodin gives no reason")
        if states == {"Done"}:
            return JobState("done")
        return JobState("running" if states - {"Waiting"} else "queued")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Download the model; links are valid for ten minutes and are renewed once."""
        path = folder / f"rodin.{self._format}"
        self._service.download(self._link(job_id), path, fresh_url=lambda: self._link(job_id))
        return Generated(path, self.model, {"format": self._format})

    def _link(self, job_id: str) -> str:
        files = self._service.post_json("download", {"task_uuid": json.loads(job_id)[0]}).get("list")
        if not files:
            raise NotFound("rodin: the files of a finished task are gone; they are kept for 7 days")
        for file in files if isinstance(files, list) else ():
            if isinstance(file, dict) and str(file.get("name", "")).lower().endswith(f".{self._format}"):
                return checked_address(file.get("url"), "rodin", "model")
        raise BadReply(f"rodin: none of its files is a .{self._format}; run it again")


def refusal_of(status: int, body: Any) -> Refusal | None:
    """Read Rodin's ``{"error": CODE, "message": ...}``; the codes "OK" and null are no errors."""
    code = body.get("error") if isinstance(body, dict) else None
    if code in (None, "", "OK"):
        return refusal_by_status(status, body)
    plain = str(code).upper().removeprefix("API_")
    message = ": ".join(dict.fromkeys(str(part) for part in (code, body.get("message")) if part))
    if plain in ACCOUNT_ERRORS:
        return Refusal(message, "denied")
    if plain in INPUT_ERRORS:
        return Refusal(message, "input")
    if plain == "PARALLELISM_LIMIT_REACHED":
        return Refusal(message, "busy")
    if status < 400:  # an unknown code in an answer with a success status
        return Refusal(message, "down" if plain == "UNKNOWN" else "bad")
    return Refusal(message, kind_of_status(status))


def _form_value(value: str | int | float | bool) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
