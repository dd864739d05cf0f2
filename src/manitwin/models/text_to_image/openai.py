"""An OpenAI-compatible images endpoint: ``POST /images/generations``.

API: https://platform.openai.com/docs/api-reference/images/create (``model``, ``prompt``, ``n``; the answer has ``data``, a
list of objects with ``b64_json`` or ``url``). The answer contains the picture itself, so it is stored in a file before
``submit`` returns the job id; after a crash in between, the job is not paid for twice. Not verified with a key.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from manitwin.config import BuildConfig, Resource
from manitwin.errors import ConfigError, Unsupported
from manitwin.models.generators.protocol import Asked, Generated, GenerationRequest, JobState
from manitwin.models.generators.vendor import usd_per_job
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer, key_from_environment, split_url
from manitwin.models.services.refusal import NotFound
from manitwin.twin.store import write_bytes_atomically

VENDOR = "https://api.openai.com/v1"
KEY = "OPENAI_API_KEY"
_LARGEST_ANSWER = 64 << 20


class OpenAiPictures:
    """Draw a text with an images endpoint.

    ``generate.options`` (such as ``size``) are added to the request; ``answers`` is the folder that stores the answers.
    """

    name = "openai"
    needs: Resource = "generator"
    asked_with: frozenset[Asked] = frozenset({"text"})

    def __init__(
        self,
        model: str,
        url: str,
        key: str | None,
        config: BuildConfig,
        answers: Path,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self.model: str | None = model
        self.usd_per_job = usd_per_job("openai", url, config.services)
        self._options: dict[str, Any] = dict(config.generate.options)
        self._answers = answers
        self._service = HttpService(
            self.name, url, authorization=bearer(key), services=config.services, key=key,
            remedy=f"check {KEY} and your account's billing", sleep=sleep,
        )  # fmt: skip

    def __repr__(self) -> str:
        return f"OpenAiPictures({self.model!r}, {self._service.base_url!r})"

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig, answers: Path) -> OpenAiPictures:
        """Create it from ``MODEL[@URL]``; raises ConfigError for a missing model, key or price."""
        model, given = split_url(argument)
        if not model:
            raise ConfigError(
                "openai: name the model that draws, as openai:gpt-image-1 or openai:MODEL@http://localhost:8000/v1"
            )
        url = given or VENDOR
        return cls(
            model, url, key_from_environment((KEY,), url, "openai", own_server=given is not None), config, answers
        )

    def submit(self, request: GenerationRequest) -> str:
        """Request a picture, store it, and return its digest as job id."""
        if not request.text:
            raise Unsupported("openai: a picture is drawn from a text alone; give a text")
        body = {"model": self.model, "prompt": request.text, "n": 1} | self._options
        answer = self._service.post_json("/images/generations", body, pays=True, max_bytes=_LARGEST_ANSWER)
        entries = answer.get("data")
        entry = entries[0] if isinstance(entries, list) and entries else None
        if not isinstance(entry, dict):
            raise self._service.unreadable("data", pays=True)
        picture = self._picture(entry)
        job_id = hashlib.sha256(picture).hexdigest()[:32]
        self._answers.mkdir(parents=True, exist_ok=True)
        write_bytes_atomically(self._answers / job_id, picture)
        return job_id

    def poll(self, job_id: str) -> JobState:
        """Return done if the picture's file exists; raises Gone otherwise."""
        if not (self._answers / job_id).is_file():
            raise NotFound("openai: the answer that was kept is gone; it is asked again")
        return JobState("done")

    def fetch(self, job_id: str, folder: Path) -> Generated:
        """Write the picture into ``folder``."""
        path = folder / "picture.png"
        write_bytes_atomically(path, (self._answers / job_id).read_bytes())
        return Generated(path, self.model, {"model": self.model})

    def _picture(self, entry: dict[str, Any]) -> bytes:
        """Return the bytes of a picture, decoded or downloaded; raises Unanswered for an unreadable entry."""
        encoded, url = entry.get("b64_json"), entry.get("url")
        if isinstance(encoded, str):
            try:
                return base64.b64decode(encoded, validate=True)
            except binascii.Error:
                raise self._service.unreadable("picture in b64_json", pays=True) from None
        if not isinstance(url, str):
            raise self._service.unreadable("b64_json or url", pays=True)
        place = self._answers / "downloaded.part"
        self._answers.mkdir(parents=True, exist_ok=True)
        self._service.download(url, place, _LARGEST_ANSWER)
        try:
            return place.read_bytes()
        finally:
            place.unlink()
