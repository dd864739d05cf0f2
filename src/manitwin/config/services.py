"""Services: how a vision-language model is asked, what services cost, and how they are reached."""

from __future__ import annotations

from pydantic import Field

from manitwin.config.section import AbsolutePath, Section


class VlmConfig(Section):
    """Asking a vision-language model. ``picture_px`` is the side of the pictures that it sees; ``votes`` are for grasp points."""

    picture_px: int = Field(default=768, ge=256, le=2048)
    max_tokens: int = Field(default=4096, ge=64)
    temperature: float | None = Field(default=0.0, ge=0, le=2)
    votes: int = Field(default=3, ge=1, le=9)
    prompts: AbsolutePath | None = None


class ServicesConfig(Section):
    """Prices of services, and how they are reached; nothing here decides what a twin is.

    ``usd_per_million_tokens`` is ``[read, written]``, ``usd_per_job`` that of the generator: what your plan says. A server
    on this machine costs nothing; for any other one a price has to be known, so that ``max_cost_usd`` can hold.
    ``record`` is a file that every answer of a VLM is added to, for ``replay:FILE``. ``submit_again``: a generator's job
    whose submit was broken off before its answer came is submitted again, although the first may have been taken and paid.
    ``timeout_s`` is for a whole request, from the look-up of its name to the last byte (of a file: one second more for each
    MiB that has come).
    """

    usd_per_million_tokens: tuple[float, float] | None = None
    usd_per_job: float | None = Field(default=None, ge=0)
    max_cost_usd: float | None = Field(default=None, gt=0)
    timeout_s: float = Field(default=300.0, gt=0)
    retries: int = Field(default=3, ge=0, le=10)
    longest_wait_s: float = Field(default=30.0, ge=0)
    cache: bool = True
    record: AbsolutePath | None = None
    submit_again: bool = False
