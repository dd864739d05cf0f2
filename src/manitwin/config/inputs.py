"""What a build does before there is a mesh: keep the input, cut a photo out, name its object, ask a generator."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from manitwin.config.section import Section


class SourceConfig(Section):
    """What a twin's folder keeps of its input: a ``copy`` byte for byte, or a ``reference``, names, sizes and digests.

    Of a scan the input is most of the folder.
    """

    keep: Literal["copy", "reference"] = "copy"


class MattingConfig(Section):
    """Reading a photo and cutting its object out. ``frame`` chooses a picture of an animation, counted from 0.

    ``network`` is asked besides the built-in one: ``isnet`` or ``u2net``, once ``manitwin models add`` has fetched it, or an ONNX
    file of U2-Net, IS-Net or BiRefNet; two of them by a comma. Below ``min_confidence``, the probability that the cut-out is
    right, a photo is rejected.
    """

    network: str | None = Field(default=None, min_length=1, max_length=4096)
    frame: int | None = Field(default=None, ge=0)
    photo_side_px: int = Field(default=2048, ge=256)
    working_side_px: int = Field(default=512, ge=128)
    min_confidence: float = Field(default=0.75, ge=0, le=1)
    min_area_share: float = Field(default=0.002, gt=0, lt=1)
    second_object_share: float = Field(default=0.12, gt=0, le=1)


class NamingConfig(Section):
    """Naming what nobody has named, from its photo or its views; less likely than ``min_probability``, it stays unknown."""

    enabled: bool = True
    min_probability: float = Field(default=0.7, gt=0, le=1)


class GenerateConfig(Section):
    """Asking a generator: a mesh that is no closed solid, or a job that fails, is asked for again, ``attempts`` times in all.

    ``options`` go to the service as they are, on top of what is asked for by itself (``tier = "Gen-2"``).
    """

    max_wait_s: float = Field(default=1800.0, gt=0)
    attempts: int = Field(default=2, ge=1, le=5)
    options: dict[str, str | int | float | bool] = Field(default_factory=dict)
