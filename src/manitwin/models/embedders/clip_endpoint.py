"""CLIP behind HTTP: pictures and texts as vectors in one space, through an embeddings endpoint.

The body is that of OpenAI's ``/embeddings`` with the additional field ``modality`` (``image``: data URIs; ``text``), as the
server infinity accepts it (github.com/michaelfeil/infinity): ``{"model", "input": [...], "modality"}``; the answer is
``{"data": [{"index", "embedding"}, ...]}``.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence

import numpy as np
from PIL import Image

from manitwin.config import ServicesConfig
from manitwin.errors import BadReply, ConfigError
from manitwin.models.services.http import HttpService
from manitwin.models.services.keys import bearer, key_from_environment, split_url

KEY = "MANITWIN_CLIP_KEY"
PATH = "embeddings"
BATCH = 16
"""Pictures or texts per request."""
MOST_NUMBERS = 1 << 14


class ClipEndpoint:
    """A CLIP model at ``MODEL@http://HOST:PORT/...`` with an optional key from the environment; vectors have unit length.

    The model that the server runs cannot be verified: its identity is a name and an address, without SHA-256. Raises the
    errors of ``HttpService``.
    """

    def __init__(self, spec: str, services: ServicesConfig):
        """Take model and address; raises ConfigError if one of them is missing, or if the key may not be sent to that address."""
        model, url = split_url(spec)
        if url is None or not model:
            raise ConfigError(f"--clip {spec!r}: not a model at an address; give MODEL@http://HOST:PORT, or a folder")
        self._model, self._sizes = model, set[int]()
        key = key_from_environment((KEY,), url, "--clip", own_server=True)
        self._service = HttpService("CLIP", url, authorization=bearer(key), services=services, key=key)
        self.name, self.sha256 = f"{model} at {url}", dict[str, str]()

    def pictures(self, pictures: Sequence[np.ndarray]) -> np.ndarray:
        """Return the unit vectors ``(N, D)`` of pictures ``(H, W, 3) uint8`` sRGB."""
        return self._vectors([_data_uri(picture) for picture in pictures], "image")

    def texts(self, texts: Sequence[str]) -> np.ndarray:
        """Return the unit vectors ``(N, D)`` of texts."""
        return self._vectors(list(texts), "text")

    def _vectors(self, inputs: Sequence[str], modality: str) -> np.ndarray:
        rows: list[np.ndarray] = []
        for first in range(0, len(inputs), BATCH):
            some = list(inputs[first : first + BATCH])
            answer = self._service.post_json(PATH, {"model": self._model, "input": some, "modality": modality})
            rows += self._read(answer.get("data"), len(some))
        return np.array(rows)

    def _read(self, data: object, count: int) -> list[np.ndarray]:
        """Return the unit vectors of an answer in the order of the inputs; raises BadReply for any other answer."""
        found: dict[int, np.ndarray] = {}
        for entry in data if isinstance(data, list) else ():
            numbers = entry.get("embedding") if isinstance(entry, dict) else None
            if not isinstance(numbers, list) or not 0 < len(numbers) <= MOST_NUMBERS:
                break
            if not all(isinstance(each, int | float) and not isinstance(each, bool) for each in numbers):
                break
            vector = np.array(numbers, np.float64)
            length = float(np.linalg.norm(vector))
            if not np.isfinite(length) or not length > 0:
                break
            found[entry.get("index", len(found))] = vector / length
            self._sizes.add(len(vector))
        if sorted(found) != list(range(count)) or len(self._sizes) != 1:
            raise BadReply(
                f"{self.name}: answers with no vector of one length for each of {count} inputs; it is not a server"
                f" of picture and text embeddings"
            )
        return [found[place] for place in range(count)]


def _data_uri(picture: np.ndarray) -> str:
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG", compress_level=1)
    return f"data:image/png;base64,{base64.b64encode(stream.getvalue()).decode()}"
