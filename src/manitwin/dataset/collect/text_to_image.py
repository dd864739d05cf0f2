"""Text-to-image drawing of the inputs that a plan lacks: each prompt is drawn once, and paid jobs are remembered."""

from __future__ import annotations

import csv
import io
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from manitwin.config import BuildConfig
from manitwin.dataset.collect.plan_files import PROMPTS
from manitwin.engine.charges import Budget, record_charges
from manitwin.engine.job_memory import RootJobMemory
from manitwin.errors import Rejected, UsageError
from manitwin.formats.csv_file import read_csv
from manitwin.formats.output_folder import require_writable_folder
from manitwin.formats.sniff import sniff
from manitwin.models.generators.protocol import GenerationRequest, Generator
from manitwin.models.generators.run import request_digest, run_generator
from manitwin.models.text_to_image.picture import picture_flaw
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import write_bytes_atomically

PICTURES, ANSWERS, JOBS, WORK = "pictures", "answers", "jobs", "work"
MANIFEST, REFUSED = "manifest.csv", "refused.csv"
STYLE = ", alone and whole in the picture, product photo, plain light grey background, soft even light"
"""Photographic requirements for segmenting the object; the prompts of a plan describe only the object itself."""
MOST_PROMPTS = 1_000_000
_SUFFIXES = {"jpeg": ".jpg"}


@dataclass(frozen=True)
class Prompt:
    """A text prompt and the name of the object it describes."""

    text: str
    name: str


@dataclass
class DrawingSummary:
    """Result of a run: pictures made, already present and refused by the model, and why it stopped early (None: it did not)."""

    made: int = 0
    there: int = 0
    refused: int = 0
    usd: float = 0.0
    stopped: str | None = None


def read_prompts(path: Path) -> list[Prompt]:
    """Return the prompts of a plan's folder, or of a CSV with the columns ``text`` and ``name``; raises UsageError."""
    file = path / PROMPTS if path.is_dir() else path
    if not file.is_file():
        raise UsageError(
            f"{file}: file not found; give a folder of `manitwin collect plan`, or a CSV with text and name"
        )
    prompts = []
    for line, row in read_csv(file, UsageError):
        text = " ".join((row.get("text") or "").split())
        if not text:
            raise UsageError(f"{file}:{line}: the text is missing; give the columns text and name")
        prompts.append(Prompt(text, (row.get("name") or "").strip()))
        if len(prompts) > MOST_PROMPTS:
            raise UsageError(f"{file}: more than {MOST_PROMPTS:,} prompts; split the file")
    return list(dict.fromkeys(prompts))


def draw_pictures(
    prompts: Sequence[Prompt],
    out: Path,
    painter: Generator,
    settings: BuildConfig,
    *,
    said: Callable[[str], None] = lambda line: None,
    sleep: Callable[[float], None] = time.sleep,
) -> DrawingSummary:
    """Draw each prompt into ``out/pictures`` and write ``out/manifest.csv``, which ``build`` and ``collect add`` read.

    Existing pictures are not requested again, pending jobs are resumed and not paid twice, and prompts that the model refused
    (``refused.csv``) are skipped. The budget ``services.max_cost_usd`` is checked before each paid job; ``stopped`` says why the
    run ended early. Raises the painter's errors other than refusals; pictures made until then are in the manifest.
    """
    require_writable_folder(out)
    for folder in (PICTURES, WORK):
        (out / folder).mkdir(parents=True, exist_ok=True)
    refused, done, budget = _read_refused(out / REFUSED), DrawingSummary(), Budget(settings.services.max_cost_usd)
    jobs = RootJobMemory(DatasetRoot(str(out)), JOBS)
    try:
        for prompt in prompts:
            request = GenerationRequest(None, prompt.text + STYLE, prompt.name or None, settings.seed)
            digest = request_digest(painter, request, settings.generate)
            if _find_picture(out, digest) is not None:
                done.there += 1
                continue
            if digest in refused:
                done.refused += 1
                continue
            if not budget.allows(painter.usd_per_job):
                done.stopped = budget.stop_reason(painter.usd_per_job)
                break
            with record_charges() as bill:
                try:
                    made = run_generator(
                        painter, request, out / WORK, settings=settings.generate, jobs=jobs,
                        submit_again=settings.services.submit_again, sleep=sleep, flaw_of=picture_flaw,
                    )  # fmt: skip
                except Rejected as error:
                    refused[digest] = (prompt.text, prompt.name, error.detail)
                    done.refused += 1
                    said(f"{prompt.text}: {error.detail}")
                else:
                    kind = sniff(made.path).format
                    os.replace(made.path, out / PICTURES / f"{digest}{_SUFFIXES.get(kind, f'.{kind}')}")
                    jobs.forget(digest)
                    done.made += 1
                    said(f"{prompt.text}: drawn")
                finally:
                    budget.end(0, bill.usd)
    finally:
        done.usd = budget.spent_usd
        _write_tables(prompts, out, painter, settings, refused)
    return done


def _find_picture(out: Path, digest: str) -> Path | None:
    return next(iter(sorted((out / PICTURES).glob(f"{digest}.*"))), None)


def _read_refused(file: Path) -> dict[str, tuple[str, str, str]]:
    if not file.is_file():
        return {}
    rows = (row for _, row in read_csv(file, UsageError))
    return {row["digest"]: (row["text"], row["name"], row["cause"]) for row in rows if row.get("digest")}


def _write_tables(
    prompts: Sequence[Prompt],
    out: Path,
    painter: Generator,
    settings: BuildConfig,
    refused: dict[str, tuple[str, str, str]],
) -> None:
    rows = []
    for prompt in prompts:
        request = GenerationRequest(None, prompt.text + STYLE, prompt.name or None, settings.seed)
        path = _find_picture(out, request_digest(painter, request, settings.generate))
        if path is not None:
            rows.append(
                (f"{PICTURES}/{path.name}", prompt.name, f"drawn by {painter.name}: {painter.model}; {prompt.text}")
            )
    write_bytes_atomically(out / MANIFEST, _table(("file", "name", "attribution"), rows))
    if refused:
        kept = [(digest, *told) for digest, told in sorted(refused.items())]
        write_bytes_atomically(out / REFUSED, _table(("digest", "text", "name", "cause"), kept))


def _table(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    return text.getvalue().encode()
