"""Settings of a run: resources, slots, retries and time limits."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from manitwin.config.section import Section

Resource = Literal["cpu", "gpu", "vlm", "generator"]
"""The resource that a stage runs on. A run has a separate number of slots for each."""

MOST_SLOTS = 1024

DEFAULT_MEMORY_GB = 16.0
"""Measured peak of a worker: 9.6 GiB of heap and stacks for 4 million triangles with an 8k texture, 1.9 GiB for a 2.4 MB file."""


class RunConfig(Section):
    """Slots, retries and time limits of a run; none of these settings affects the content of a twin.

    ``cpu``, ``gpu``, ``vlm`` and ``generator`` are the numbers of stages of that resource that run at the same time (cpu 0: one
    per core, as far as memory allows). On a Ray cluster the gpu slots are its GPUs, and cpu 0 means all of its cores.
    ``vlm_per_minute`` limits how many stages that call a VLM start per minute. A stage that fails or kills its worker is tried
    ``attempts`` times. A service that is down is called again for ``patience_s`` before its items are left for the next run.
    ``memory_gb`` is the memory limit of each worker process (units of 2^30 bytes, heap and stacks): an input that needs more is
    rejected as ``too_large`` (0: no limit). ``in_flight`` limits the items that have started and not ended. The index tables
    are updated after every ``index_every`` twins (0: never; ``manitwin index`` writes them).
    """

    cpu: int = Field(default=0, ge=0, le=MOST_SLOTS)
    gpu: int = Field(default=1, ge=1, le=MOST_SLOTS)
    vlm: int = Field(default=8, ge=1, le=MOST_SLOTS)
    generator: int = Field(default=4, ge=1, le=MOST_SLOTS)
    vlm_per_minute: float = Field(default=600.0, gt=0)
    attempts: int = Field(default=3, ge=1)
    stage_timeout_s: float = Field(default=1800.0, gt=0)
    patience_s: float = Field(default=1800.0, ge=0)
    memory_gb: float = Field(default=DEFAULT_MEMORY_GB, ge=0)
    in_flight: int = Field(default=1000, ge=1)
    index_every: int = Field(default=500, ge=0)
    keep_work: bool = True
