"""Any text-to-image endpoint behind fal's queue.

API of the queue: ``generators.fal``. Endpoints for pictures take ``prompt`` and ``seed`` and answer with ``images``, a list
of objects with ``url`` and ``content_type`` (https://fal.ai/models/fal-ai/flux/dev/api). Not verified with a key.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from manitwin.models.generators.fal import Endpoint, FalGenerator

DEFAULT = "fal-ai/flux/dev"


class FalPictures(FalGenerator):
    """Draw a text with an endpoint of fal; ``generate.options`` are added to its input. No prices are listed."""

    default_model = DEFAULT
    written_name, made = "picture.png", "picture"

    @staticmethod
    def endpoint_input(endpoint: str) -> Endpoint:
        """Return the input description of any endpoint: a text and a seed."""
        return Endpoint(None, prompt=True, seeds=2**31)

    @staticmethod
    def first_address(result: Any) -> str | None:
        """Return the address of the first picture: of ``images``, or of ``image`` if there is only one."""
        if not isinstance(result, Mapping):
            return None
        images = result.get("images")
        found = images[0] if isinstance(images, list) and images else result.get("image")
        url = found.get("url") if isinstance(found, Mapping) else found
        return url if isinstance(url, str) else None
