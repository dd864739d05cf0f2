"""Settings of external services: calls to a vision-language model, prices, timeouts and retries."""

from __future__ import annotations

from pydantic import Field

from manitwin.config.section import AbsolutePath, Section


class VlmConfig(Section):
    """Calls to a vision-language model. ``picture_px``: side of the images sent; ``votes``: number of answers about grasp
    points.
    """

    picture_px: int = Field(default=768, ge=256, le=2048)
    max_tokens: int = Field(default=4096, ge=64)
    temperature: float | None = Field(default=0.0, ge=0, le=2)
    votes: int = Field(default=3, ge=1, le=9)
    prompts: AbsolutePath | None = None


class ServicesConfig(Section):
    """Prices of services and connection settings; none of these settings affects the content of a twin.

    ``usd_per_million_tokens`` is ``[input, output]`` and ``usd_per_job`` the price of a generator job, according to your plan.
    A server on this machine costs nothing; for any other server the price must be given for ``max_cost_usd`` to work.
    ``record`` is a file to which every VLM answer is appended, for ``replay:FILE``. ``submit_again``: if a generator request
    was interrupted before its answer arrived, submit it again, although the first job may have been accepted and charged.
    ``timeout_s`` limits a whole request, from name resolution to the last byte (for file downloads, plus one second per MiB
    received).
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
