"""The generator ``meshy``: Meshy's image-to-3d and text-to-3d.

API: https://docs.meshy.ai/api/image-to-3d, https://docs.meshy.ai/api/text-to-3d, https://docs.meshy.ai/api/errors and
https://docs.meshy.ai/api/balance, read 2026-11. Not verified: that the alpha channel of a PNG is used as the mask; models
newer than meshy-6.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from manitwin.config import BuildConfig
from manitwin.errors import BadReply, Rejected
from manitwin.models.generators.protocol import Generated, GenerationRequest, JobState
from manitwin.models.generators.vendor import (
    VendorGenerator,
    checked_address,
    data_uri,
    is_name,
    plausible_number,
    submit_paid,
)

VENDOR = "https://api.meshy.ai"
KEY_VARIABLE = "MESHY_API_KEY"
DEFAULT_MODEL = "meshy-6"
IMAGE, TEXT, BALANCE = "/openapi/v1/image-to-3d", "/openapi/v2/text-to-3d", "/openapi/v1/balance"
LONGEST_TEXT = 600  # characters of a prompt, as documented
REFINE_OPTIONS = frozenset({"enable_pbr", "hd_texture", "texture_prompt", "texture_image_url", "remove_lighting"})
COMMON_OPTIONS = frozenset({"moderation", "auto_size", "origin_at"})
STATES = {"PENDING": "queued", "IN_PROGRESS": "running", "SUCCEEDED": "done", "FAILED": "failed", "CANCELED": "failed"}
PAGE_SIZE = 50  # tasks per page of the list; the documented maximum
MOST_PAGES = 20


class MeshyGenerator(VendorGenerator):
    """Make textured meshes with Meshy; ``generate.options`` are added to the request.

    A text takes two paid tasks, a preview and a refine task that textures it; the job is identified by the preview. A process
    that takes over a job looks for the refine task among the account's latest tasks, by its text, before it submits one.
    """

    name = "meshy"
    url, keys = VENDOR, (KEY_VARIABLE,)
    default_model, model_option = DEFAULT_MODEL, "ai_model"
    remedy = f"check {KEY_VARIABLE} and your credits at https://www.meshy.ai/settings/api"

    def __init__(
        self, model: str, url: str, key: str | None, config: BuildConfig, sleep: Callable[[float], None] = time.sleep
    ):
        super().__init__(model, url, key, config, sleep)
        self._own_previews: set[str] = set()  # submitted by this object and not yet refined
        self._refines: dict[str, str] = {}

    def probe(self) -> str:
        """Query the account's balance."""
        balance = plausible_number(self._service.get_json(BALANCE).get("balance"))
        if balance is None:
            raise BadReply("meshy: its answer about the balance has no 'balance'")
        return f"{balance:g} credits left"

    def submit(self, request: GenerationRequest) -> str:
        """Submit a task; raises Rejected for an empty text or one that is longer than Meshy takes."""
        if request.rgba is not None:
            body = {
                "image_url": data_uri(request.rgba),
                "ai_model": self.model,
                "should_texture": True,
                "enable_pbr": True,
                "target_formats": ["glb"],
            }
            job_id = f"image:{self._submit(IMAGE, body | self._options)}"
        else:
            text = request.text or ""
            if not 0 < len(text) <= LONGEST_TEXT:
                detail = f"meshy takes texts of 1 to {LONGEST_TEXT} characters; this one has {len(text)}"
                raise Rejected("generator_failed", detail, "generate")
            body = {"mode": "preview", "prompt": text, "ai_model": self.model, "target_formats": ["glb"]}
            preview = self._submit(TEXT, body | self._options_without(REFINE_OPTIONS))
            self._own_previews.add(preview)
            job_id = f"text:{preview}"
        return job_id

    def poll(self, job_id: str) -> JobState:
        """Return the state of a job; for a text, a finished preview is followed by a refine task."""
        kind, id = _split_job_id(job_id)
        if kind == "image":
            return _state(self._task(IMAGE, id))
        if id not in self._refines:
            preview = self._task(TEXT, id)
            state = _state(preview)
            if state.state != "done":
                return state
            self._refine(preview)
        return _state(self._task(TEXT, self._refines[id]))

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Download the GLB into ``folder``."""
        kind, id = _split_job_id(job_id)
        place, tasks = IMAGE, [id]
        if kind == "text":
            if id not in self._refines:
                self._refine(self._task(TEXT, id))
            place, tasks = TEXT, [id, self._refines[id]]
        made = [self._task(place, task) for task in tasks]
        path = folder / "generated.glb"
        self._service.download(_link(made[-1]), path, fresh_url=lambda: _link(self._task(place, tasks[-1])))
        credits = [used for task in made if (used := plausible_number(task.get("consumed_credits"))) is not None]
        return Generated(path, self.model, {"consumed_credits": sum(credits)} if credits else {})

    def _refine(self, preview: Mapping[str, Any]) -> None:
        """Find the refine task of a preview that another process may have submitted, otherwise submit one."""
        id, text = str(preview["id"]), str(preview.get("prompt") or "")
        body: dict[str, Any] = {
            "mode": "refine",
            "preview_task_id": id,
            "ai_model": self.model,
            "enable_pbr": True,
            "target_formats": ["glb"],
        }
        if text and "texture_image_url" not in self._options:
            body["texture_prompt"] = text  # the list of tasks returns this text, which identifies the refine task
        body |= {name: value for name, value in self._options.items() if name in REFINE_OPTIONS | COMMON_OPTIONS}
        if id in self._own_previews:
            found = None
            self._own_previews.discard(id)  # if this answer is lost, the next attempt looks in the list
        else:
            found = self._refine_among_latest(preview, str(body.get("texture_prompt", text)))
        self._refines[id] = found or self._submit(TEXT, body)

    def _refine_among_latest(self, preview: Mapping[str, Any], text: str) -> str | None:
        """Return the id of the refine task with this text among the tasks created after the preview, None if there is none."""
        since = plausible_number(preview.get("finished_at")) or 0
        for page in range(1, MOST_PAGES + 1):
            tasks = self._list_tasks(page)
            for task in tasks:
                if task.get("type") != "text-to-3d-refine" or _creation_time(task) < since:
                    continue
                if text == (task.get("texture_prompt") or task.get("prompt")) and is_name(task.get("id")):
                    return str(task["id"])
            if len(tasks) < PAGE_SIZE or any(_creation_time(task) < since for task in tasks):
                return None
        return None

    def _list_tasks(self, page: int) -> list[dict[str, Any]]:
        tasks = self._service.get_list(f"{TEXT}?page_num={page}&page_size={PAGE_SIZE}&sort_by=-created_at")
        if not all(isinstance(task, dict) for task in tasks):
            raise BadReply("meshy: its list of tasks contains other items; run it again")
        return tasks

    def _submit(self, place: str, body: Mapping[str, Any]) -> str:
        return str(submit_paid(self._service, place, body, ("result",))["result"])

    def _task(self, place: str, id: str) -> dict[str, Any]:
        task = self._service.get_json(f"{place}/{quote(id, safe='')}")
        status, error = task.get("status"), task.get("task_error")
        if not isinstance(status, str) or status not in STATES:
            raise BadReply(
                f"meshy: task {self._service.said(id)} has the unknown status {self._service.said(str(status))!r}"
            )
        said = self._service.said(str(error.get("message") or "")) if isinstance(error, Mapping) else ""
        return task | {"id": id, "said": said}

    def _options_without(self, names: frozenset[str]) -> dict[str, Any]:
        return {name: value for name, value in self._options.items() if name not in names}


def _split_job_id(job_id: str) -> tuple[str, str]:
    kind, _, id = job_id.partition(":")
    if kind not in ("image", "text") or not id:
        raise BadReply(f"meshy: {job_id!r} is not a job id of this generator; run it again")
    return kind, id


def _state(task: Mapping[str, Any]) -> JobState:
    state = STATES[task["status"]]
    return JobState(state, task["said"] or task["status"].lower() if state == "failed" else "")  # type: ignore[arg-type]


def _creation_time(task: Mapping[str, Any]) -> float:
    return plausible_number(task.get("created_at")) or 0


def _link(task: Mapping[str, Any]) -> str:
    urls = task.get("model_urls")
    return checked_address(urls.get("glb") if isinstance(urls, Mapping) else None, "meshy", "GLB")
