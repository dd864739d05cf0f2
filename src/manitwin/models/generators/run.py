"""Drive a generator's job to its end."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from manitwin.errors import BadReply, Rejected, Unavailable
from manitwin.models.generators.protocol import Generated, GenerationRequest, Generator

FIRST_WAIT_S = 1.0
LONGEST_WAIT_S = 30.0


def run_generator(
    generator: Generator,
    request: GenerationRequest,
    folder: Path,
    *,
    max_wait_s: float = 1800.0,
    sleep: Callable[[float], None] = time.sleep,
) -> Generated:
    """Submit ``request``, wait for it and fetch the mesh into ``folder``.

    Waits double from 1 s to 30 s and add up to at most ``max_wait_s`` (waits are counted, not the clock). Raises Rejected
    ``generator_failed`` where the generator gives up, Unavailable where it does not finish, BadReply where it leaves no
    file, and what the generator itself raises.
    """
    job_id = generator.submit(request)
    waited, pause = 0.0, FIRST_WAIT_S
    while (job := generator.poll(job_id)).state not in ("done", "failed"):
        if waited + pause > max_wait_s:
            raise Unavailable(
                f"{generator.name}: job {job_id} is still {job.state} after {waited:.0f} s; run again later,"
                " or raise generate.max_wait_s"
            )
        sleep(pause)
        waited += pause
        pause = min(2 * pause, LONGEST_WAIT_S)
    if job.state == "failed":
        raise Rejected("generator_failed", f"{generator.name}: {job.message or 'gave no reason'}", "generate")
    generated = generator.fetch(job_id, folder)
    if not generated.path.is_file() or generated.path.stat().st_size == 0:
        raise BadReply(
            f"{generator.name}: job {job_id} is done but left no mesh at {generated.path.name}; run it again"
        )
    return generated
