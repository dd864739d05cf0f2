"""A recipe without meshes, to rehearse a run: stages that do nothing, or fail as the item's text says.

The text of an item is words apart by spaces, each ``what:stage`` or ``what:stage:more``:

    reject:b              the stage rejects the item
    raise:b               it raises an error, each time
    segfault:b            it kills its process with SIGSEGV, each time
    segfault-once:b       the first time only
    hang:b                it does not end
    stuck:b               it does not end, in native code
    eat:b:2               it takes so many gigabytes of memory
    bad_alloc:b           it is refused memory as C++ is: a line on stderr, and SIGABRT
    unavailable:b:/file   it raises Unavailable while that file is there
    limited:b:/file       it raises RateLimited (0.2 s) while that file is there
    denied:b:/file        it raises AccessDenied while that file is there
    charge:b:0.02         a service charges so many USD, each time
    sleep:b:1.5           it takes so many seconds
    parts:b:/file         it says that one of two things is done, and waits until that file is there
    wait:b:/file          it does not end before that file is there

Every run of a stage adds a line ``<twin_id> <stage>`` to the recipe's log, so that a test can count them.
"""

from __future__ import annotations

import os
import re
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

from pydantic import BaseModel

from manitwin.config import Resource
from manitwin.engine.charges import charge
from manitwin.engine.folder_recipe import FolderRecipe
from manitwin.engine.recipe import Ending, Identity, Tables
from manitwin.engine.stage import Draft, Stage, report_progress
from manitwin.engine.stage_runner import StageCost
from manitwin.errors import AccessDenied, RateLimited, Rejected, Unavailable
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.integrity import find_size_damage, write_sizes
from manitwin.twin.migration import SCHEMA_VERSION
from manitwin.twin.record import TwinRecord
from manitwin.twin.store import (
    RECORD,
    RUN,
    canonical_json,
    parse_record,
    sha256_of_json,
    write_bytes_atomically,
    write_twin_record,
)
from rehearsal_cube import CUBE, cube_files


class RehearsalSettings(BaseModel):
    """What is part of a rehearsed stage's key."""

    bytes: int = 0


class RehearsedStage:
    """Write a field, and a file of so many bytes, after doing what the item's text says."""

    backend = "rehearsal"
    model: str | None = None

    def __init__(
        self, name: str, reads: tuple[str, ...], needs: Resource, version: str, size: int, log: Path | None, usd: float
    ):
        self.name, self.reads, self.needs, self.version = name, reads, needs, version
        self.expected_usd = usd
        self.writes: tuple[str, ...] = (name, f"{name}.bin") if size else (name,)
        self.settings = RehearsalSettings(bytes=size)
        self._log = log

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Do as the item says; raises what it says."""
        if self._log is not None:
            with self._log.open("a") as stream:
                stream.write(f"{draft.item_id} {self.name}\n")
        for word in (draft.payload.text or "").split():
            what, _, where = word.partition(":")
            stage, _, more = where.partition(":")
            if stage == self.name:
                self._act(what, more, draft.item_id)
        if self.settings.bytes:
            (folder / f"{self.name}.bin").write_bytes(b"\0" * self.settings.bytes)
        return {self.name: {"version": self.version, "after": [draft.field(name) for name in self.reads][-1:]}}

    def _act(self, what: str, more: str, twin_id: str) -> None:
        if what == "reject":
            raise Rejected("poor_quality", "the text says so", stage="gate")
        if what == "raise":
            raise RuntimeError("the text says so")
        if what == "segfault" or (what == "segfault-once" and self._first_time(twin_id)):
            signal.raise_signal(signal.SIGSEGV)
        if what == "unavailable" and Path(more).exists():
            raise Unavailable(f"{self.name}: down while {more} is there")
        if what == "limited" and Path(more).exists():
            raise RateLimited(f"{self.name}: asks to wait while {more} is there", 0.2)
        if what == "denied" and Path(more).exists():
            raise AccessDenied(f"{self.name}: refused while {more} is there")
        if what == "charge":
            charge(float(more))
        if what == "sleep":
            time.sleep(float(more))
        if what == "parts":
            report_progress(1, 2, "things")
        while what in ("wait", "parts") and not Path(more).exists():
            time.sleep(0.02)
        if what == "hang":
            _hang()
        if what == "stuck":
            re.match("(a+)+b", "a" * 64)
        if what == "eat":
            bytearray(int(more) << 30)
        if what == "bad_alloc":
            os.write(2, b"terminate called after throwing an instance of 'std::bad_alloc'\n  what():  std::bad_alloc\n")
            os.abort()

    def _first_time(self, twin_id: str) -> bool:
        assert self._log is not None, "a recipe without a log cannot count"
        return self._log.read_text().splitlines().count(f"{twin_id} {self.name}") == 1


def _hang() -> NoReturn:
    while True:
        time.sleep(1)


@dataclass(frozen=True)
class RehearsalRecipe(FolderRecipe[TwinRecord]):
    """Stages by name and what they need, each reading the one before it; ``size`` bytes each leaves as a file.

    ``usd`` is what those are expected to cost that do not run on cores.
    """

    payload = Item
    record = RECORD

    plan: tuple[tuple[str, Resource], ...] = (("a", "cpu"), ("b", "cpu"), ("c", "cpu"))
    versions: tuple[tuple[str, str], ...] = ()
    size: int = 0
    log: Path | None = None
    seed: int = 0
    usd: float = 0.0
    tables: Tables | None = None
    files: dict[str, bytes] = field(
        default_factory=cube_files
    )  # made where a run begins: its workers start without meshes

    @property
    def sha256(self) -> str:
        """The digest of what decides the results."""
        return sha256_of_json([self.plan, self.versions, self.size, self.seed])

    def folder_of(self, item_id: str) -> str:
        """Return the twin's folder."""
        return twin_name(item_id)

    def identify(self, payload: Item) -> Identity:
        """Return the hash of the text."""
        return Identity(sha256_of_json([payload.text, payload.name])[:16], "text")

    def stages(self, kind: str) -> list[Stage]:
        """Return the stages."""
        versions = dict(self.versions)
        return [
            RehearsedStage(
                name,
                (self.plan[at - 1][0],) if at else (),
                needs,
                versions.get(name, "1"),
                self.size,
                self.log,
                0.0 if needs == "cpu" else self.usd,
            )
            for at, (name, needs) in enumerate(self.plan)
        ]

    def damage(self, root: DatasetRoot, item_id: str) -> str | None:
        """Return what is wrong with a twin's folder by the sizes of its files."""
        return find_size_damage(root, twin_name(item_id))

    def parse(self, record: bytes) -> TwinRecord:
        """Read a twin's record."""
        return parse_record(record)

    def is_current(self, record: TwinRecord) -> bool:
        """Tell whether a folder is of this very recipe."""
        return record.provenance.config_sha256 == self.sha256

    def ending(self, record: TwinRecord) -> Ending:
        """Return how a record says that its item ended."""
        if record.rejection is None:
            return Ending("accepted", record.revision, None, "")
        return Ending("rejected", record.revision, record.rejection.reason, record.rejection.detail)

    def write(
        self,
        draft: Draft[Item],
        kind: str,
        costs: dict[str, StageCost],
        rejected: Rejected | None,
        stage: str,
        fresh: Path,
    ) -> TwinRecord:
        """Write a folder with a valid record."""
        costs_json = {"stages": {name: vars(cost) for name, cost in costs.items()}, "host": {}}
        write_bytes_atomically(fresh / RUN, canonical_json(costs_json).encode())
        (fresh / "prompt.txt").write_text(draft.payload.text or "")
        if rejected is None:
            for name, file in self.files.items():
                (fresh / name).write_bytes(file)
        sealed = write_twin_record(fresh, rehearsed_record(draft, self.sha256, rejected))
        write_sizes(fresh)
        return sealed


def rehearsed_record(draft: Draft[Item], recipe_sha256: str, rejected: Rejected | None) -> dict[str, Any]:
    """Return the content of a record: all a rehearsal can say of a twin is that it was rejected, or that it is a cube."""
    common = {
        "schema_version": SCHEMA_VERSION,
        "twin_id": draft.item_id,
        "name": draft.payload.name,
        "status": "rejected" if rejected else "accepted",
        "rejection": rejected and {"stage": "gate", "reason": rejected.reason, "detail": rejected.detail},
        "source": {"kind": "text", "file": "prompt.txt", "sha256": sha256_of_json(draft.payload.text), "license": "CC0-1.0"},
        "provenance": {"manitwin_version": "rehearsal", "config_sha256": recipe_sha256, "seed": draft.seed, "stages": {}},
        "quality": {"checks": []},
    }  # fmt: skip
    return common if rejected else common | CUBE
