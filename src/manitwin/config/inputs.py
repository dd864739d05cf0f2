"""Settings of the stages before there is a mesh: keeping the input, cutting out a photo, naming its object, calling a
generator.
"""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from manitwin.config.section import Section


class SourceConfig(Section):
    """How a twin's folder keeps its input: as a byte-exact ``copy``, or as a ``reference`` with names, sizes and digests.

    For scans the input is most of the folder's size.
    """

    keep: Literal["copy", "reference"] = "copy"


class MattingConfig(Section):
    """Reading a photo and cutting its object out. ``frame`` selects a frame of an animation, counted from 0.

    ``network`` is a matting network used in addition to the built-in method: ``isnet`` or ``u2net``, once downloaded with
    ``manitwin models add``, or an ONNX file of U2-Net, IS-Net or BiRefNet; separate two of them by a comma. A photo is rejected
    if the estimated probability that its cut-out is correct is below ``min_confidence``.
    """

    network: str | None = Field(default=None, min_length=1, max_length=4096)
    frame: int | None = Field(default=None, ge=0)
    photo_side_px: int = Field(default=2048, ge=256)
    working_side_px: int = Field(default=512, ge=128)
    min_confidence: float = Field(default=0.75, ge=0, le=1)
    min_area_share: float = Field(default=0.002, gt=0, lt=1)
    second_object_share: float = Field(default=0.12, gt=0, le=1)


class NamingConfig(Section):
    """Naming unnamed objects from their photo or rendered views; below ``min_probability`` the name stays unknown."""

    enabled: bool = True
    min_probability: float = Field(default=0.7, gt=0, le=1)


class GenerateConfig(Section):
    """Calling a generator. A mesh that is not a closed solid, or a failed job, is requested again, up to ``attempts`` calls in
    all.

    ``options`` are passed to the service unchanged, in addition to the built-in options (``tier = "Gen-2"``).
    """

    max_wait_s: float = Field(default=1800.0, gt=0)
    attempts: int = Field(default=2, ge=1, le=5)
    options: dict[str, str | int | float | bool] = Field(default_factory=dict)
