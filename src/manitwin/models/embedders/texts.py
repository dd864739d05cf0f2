"""Text embeddings: from the embeddings API that OpenAI, vLLM, Ollama and others serve, or from the files of a CLIP model."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol
from urllib.parse import urlsplit

import numpy as np

from manitwin.config import ServicesConfig
from manitwin.errors import ConfigError
from manitwin.models.embedders.clip import TEXT, ClipFolder
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer, key_from_environment, split_url
from manitwin.models.vlm.chat_from_spec import KEY_OF_HOST, KEY_OF_OTHERS
from manitwin.models.vlm.openai_chat import OPENAI_URL, openai_refusal

BATCH = 64
MOST_NUMBERS = 65536


class TextEmbedder(Protocol):
    """Protocol of a model that embeds texts."""

    @property
    def identity(self) -> str:
        """Identity of the model; it determines the vectors."""
        ...

    def embed(self, texts: Sequence[str]) -> np.ndarray:
        """Return the unit vectors ``(N, D) float32`` of texts, in order."""
        ...


class ServedTexts:
    """Text embeddings of a model on a server (https://platform.openai.com/docs/api-reference/embeddings/create).

    Raises the errors of ``HttpService``, and BadReply unless the answer has one finite vector per text, all of the same
    length.
    """

    def __init__(self, model: str, base_url: str, key: str | None, services: ServicesConfig):
        self.model, self.base_url = model, base_url
        self._service = HttpService(
            "openai", base_url, authorization=bearer(key), services=services, key=key, refusal=openai_refusal
        )

    @property
    def identity(self) -> str:
        """Identity of the model: server and model name."""
        return f"{self.base_url} {self.model}"

    def embed(self, texts: Sequence[str]) -> np.ndarray:
        """Return the unit vectors ``(N, D) float32`` of texts, in order."""
        rows: list[np.ndarray] = []
        for begin in range(0, len(texts), BATCH):
            asked = list(texts[begin : begin + BATCH])
            answer = self._service.post_json("embeddings", {"model": self.model, "input": asked})
            rows += self._vectors(answer.get("data"), len(asked))
        if len({len(row) for row in rows}) > 1:
            raise self._service.unreadable("vectors of one length")
        return np.array(rows, np.float32)

    def _vectors(self, data: Any, count: int) -> list[np.ndarray]:
        """Read ``data[].embedding``, ordered by ``index``, and normalize the vectors."""
        found: dict[int, np.ndarray] = {}
        for each in data if isinstance(data, list) else ():
            values = each.get("embedding") if isinstance(each, dict) else None
            place = each.get("index") if isinstance(each, dict) else None
            if not (isinstance(values, list) and 0 < len(values) <= MOST_NUMBERS and type(place) is int):
                break
            if not all(type(value) in (int, float) and math.isfinite(value) for value in values) or not any(values):
                break
            vector = np.array(values, np.float64)
            found[place] = vector / np.linalg.norm(vector)
        if sorted(found) != list(range(count)):
            raise self._service.unreadable(f"data[].embedding for each of {count} texts: it is no answer of embeddings")
        return [found[place] for place in range(count)]


class ClipTexts:
    """Text embeddings of the text network in a CLIP folder (``ClipFolder``), computed locally."""

    def __init__(self, folder: Path):
        """Check the folder's files; raises UsageError if some are missing."""
        self._clip = ClipFolder(folder)

    @property
    def identity(self) -> str:
        """Identity of the model: digests of the network and its vocabulary."""
        digests = self._clip.sha256
        return f"clip {' '.join(digests[name] for name in (TEXT, 'vocab.json', 'merges.txt'))}"

    def embed(self, texts: Sequence[str]) -> np.ndarray:
        """Return the unit vectors ``(N, D) float32`` of texts, in order."""
        return self._clip.texts(texts).astype(np.float32) if len(texts) else np.empty((0, 0), np.float32)


def text_embedder(spec: str, services: ServicesConfig) -> TextEmbedder:
    """Return the embedder named by ``openai:MODEL``, ``openai:MODEL@URL`` or ``clip:FOLDER``.

    Raises ConfigError for a missing model or key, UsageError for a folder without the files of a CLIP model.
    """
    name, _, argument = spec.partition(":")
    if name == "clip" and argument:
        return ClipTexts(Path(argument))
    model, url = split_url(argument)
    if name != "openai" or not model:
        raise ConfigError(
            f"{spec!r} is not an embedding model; give clip:FOLDER, openai:MODEL, or openai:MODEL@URL for a server"
            f" of your own"
        )
    url = url or OPENAI_URL
    key_name = KEY_OF_HOST.get(urlsplit(url).hostname or "", KEY_OF_OTHERS)
    key = key_from_environment((key_name,), url, spec, own_server=key_name == KEY_OF_OTHERS)
    return ServedTexts(model, url, key, services)
