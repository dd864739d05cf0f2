"""Do one job: what runs in a worker process, on this machine or another."""

from __future__ import annotations

import errno
import shutil
import time
import traceback
from dataclasses import replace
from functools import partial

from manitwin.config import Resource
from manitwin.engine.amendments import AMENDMENTS, Amendments, amendments_sha256, read_amendments
from manitwin.engine.charges import counted
from manitwin.engine.job_memory import RootJobMemory
from manitwin.engine.jobs import (
    Failure,
    Finish,
    Job,
    Reply,
    RunStage,
    StageRejected,
    Survey,
    Surveyed,
    WorkerSetup,
    WriteTables,
)
from manitwin.engine.lost_charges import lost_usd
from manitwin.engine.recipe import Ending
from manitwin.engine.stage import INPUT, Draft, Stage, StagePart
from manitwin.engine.stage_runner import JOBS, StageCost, StageRun, WorkFolder, present_reads
from manitwin.engine.task import Payload, Task
from manitwin.errors import (
    AccessDenied,
    BackendError,
    InputChanged,
    ManiTwinError,
    NewerVersion,
    RateLimited,
    Rejected,
    TwinError,
    Unavailable,
    Unsupported,
)
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import WORK

NO_SPACE = (errno.ENOSPC, errno.EDQUOT)
TOO_LARGE = "too_large"
"""The reason of an item for which a stage needs more memory than a worker may take; every recipe that rejects has it."""


class Worker:
    """Does jobs one after the other; owns the stages, which are made once a kind."""

    def __init__(self, setup: WorkerSetup):
        self.setup, self.root = setup, DatasetRoot(setup.root_url)
        self._stages: dict[str, list[Stage]] = {}
        self._amends = self.root.exists(AMENDMENTS)

    def do(self, job: Job) -> Reply:
        """Return the job's answer; never raises but for what ends a process."""
        with counted() as bill:
            reply = self._reply(job)
        if isinstance(reply, Failure | StageRun | StageRejected):
            return replace(reply, charged_usd=bill.usd)
        return reply

    def _reply(self, job: Job) -> Reply:
        try:
            return self._do(job)
        except RateLimited as error:
            return Failure("rate_limited", _line(error), error.retry_after_s)
        except Unavailable as error:
            return Failure("unavailable", _line(error))
        except AccessDenied as error:
            return Failure("denied", _line(error))
        except Unsupported as error:
            return Failure("unsupported", _line(error))
        except InputChanged as error:
            return Failure("changed", " ".join(str(error).split()))
        except NewerVersion as error:  # of no other folder either should an older one take the place: the run stops
            return Failure("denied", " ".join(str(error).split()))
        except BackendError as error:
            return Failure("error", _line(error))
        except OSError as error:
            kind = "no_space" if error.errno in NO_SPACE else "error"
            return Failure(kind, _line(error))  # type: ignore[arg-type]
        except MemoryError:
            return Failure("error", f"it {too_much_memory(self.setup.memory_gb)}; raise the limit, or use fewer --jobs")
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            said = f"{_line(error)} ({where.filename.rsplit('/', 1)[-1]}:{where.lineno})"
            return Failure("error", said, trace=traceback.format_exc())

    def _do(self, job: Job) -> Reply:
        if isinstance(job, Survey):
            return self._survey(job)
        if isinstance(job, RunStage):
            return self._run(job)
        if isinstance(job, Finish):
            return self._finish(job)
        self._write_tables(job)
        return None

    def stages(self, kind: str) -> list[Stage]:
        """Return the stages for a kind of input."""
        if kind not in self._stages:
            self._stages[kind] = self.setup.recipe.stages(kind)
        return self._stages[kind]

    def _survey(self, job: Survey) -> Surveyed:
        identity = self.setup.recipe.identify(job.task.payload)
        ending = self._ending(identity.item_id)
        if identity.rejected is not None:
            rejected = StageRejected(identity.rejected, StageCost(0.0, 0.0, 0.0))
            return Surveyed(identity.item_id, identity.kind, ending, rejected=rejected)
        work, draft = self._work(identity.item_id), self._draft(identity.item_id, job.task.payload)
        work.sweep()
        done: list[tuple[str, StageRun]] = []
        for stage in self.stages(identity.kind):
            found = work.find(stage, draft)
            if found is None:
                break
            done.append((stage.name, found))
        return Surveyed(identity.item_id, identity.kind, ending, tuple(done))

    def _ending(self, item_id: str) -> Ending | None:
        recipe = self.setup.recipe
        name = f"{recipe.folder_of(item_id)}/{recipe.record}"
        try:
            amended = amendments_sha256(self._draft_amendments(item_id))
            return recipe.ending_of(self.root.read_bytes(name), amended) if self.root.exists(name) else None
        except NewerVersion as error:
            raise NewerVersion(f"{recipe.folder_of(item_id)}/{error}") from error
        except TwinError:  # no file that is read: what is made takes its place
            return None

    def _run(self, job: RunStage) -> StageRun | StageRejected:
        stages = self.stages(job.kind)
        stage, work, draft = (
            stages[job.position],
            self._work(job.task.item_id),
            self._draft(job.task.item_id, job.task.payload),
        )
        draft.amendments = {name: each for name, each in draft.amendments.items() if name == stage.name}
        work.sweep()  # of a worker that died at it
        wanted = {name.removesuffix("?") for name in stage.reads}
        writers = {s.name for s in stages if wanted & set(s.writes)}
        work.load(draft, [d for d in job.done if d[0] in writers], {s.name: s for s in stages}, wanted)
        started, cpu_started = time.perf_counter(), time.process_time()
        reads_input = not present_reads(stage, draft.names())
        require_same = partial(self._require_same, job.task) if reads_input else _nothing
        try:
            return work.run(stage, draft, require_same)
        except (Rejected, MemoryError) as error:
            require_same()
            if isinstance(error, MemoryError) and not self.setup.recipe.can_reject:
                raise
            answer = error if isinstance(error, Rejected) else too_large(job, self.setup.memory_gb)
            seconds, cpu_seconds = time.perf_counter() - started, time.process_time() - cpu_started
            cost = StageCost(seconds, cpu_seconds, lost_usd(work.place / stage.name))
            return StageRejected(answer, cost, rehearsed=stage.name in draft.rehearsed)

    def _finish(self, job: Finish) -> Ending:
        stages, work = {s.name: s for s in self.stages(job.kind)}, self._work(job.task.item_id)
        draft = self._draft(job.task.item_id, job.task.payload)
        costs = work.load(draft, job.done, stages, None)
        answer = None if job.rejected is None else job.rejected.answer
        if job.rejected is not None and job.stage != INPUT:
            costs[job.stage] = job.rejected.cost
            draft.rehearsed.update([job.stage] if job.rejected.rehearsed else [])
        try:
            ending = self.setup.recipe.finish(draft, job.kind, costs, answer, job.stage, work.fresh)
            self._require_same(job.task)
            self.root.put_folder(work.fresh, self.setup.recipe.folder_of(job.task.item_id), self.setup.recipe.record)
        except Rejected:  # as a file of the input is gone: a finished folder has nothing to reject by itself
            self._require_same(job.task)
            raise
        except InputChanged:
            work.drop()  # nobody knows which of its results are of the bytes that the id stands for
            raise
        finally:
            shutil.rmtree(work.fresh, ignore_errors=True)
        if not self.setup.keep_work:
            work.drop()
        return ending

    def _require_same(self, task: Task) -> None:
        """Raise InputChanged where the input is not any more what the item's id stands for."""
        if self.setup.recipe.identify(task.payload).item_id != task.item_id:
            raise InputChanged(f"{task.payload.title}: was changed while it was processed; rerun the same command")

    def _write_tables(self, job: WriteTables) -> None:
        tables = self.setup.recipe.tables
        if tables is None:
            raise ManiTwinError("a run of a recipe without tables was asked to write them")
        if job.item_ids:
            tables.add(self.root, job.item_ids)
        else:
            tables.merge(self.root)

    def _work(self, item_id: str) -> WorkFolder:
        work = WorkFolder(self.root, item_id, self.setup.cache)
        work.place.mkdir(parents=True, exist_ok=True)
        return work

    def _draft(self, item_id: str, payload: Payload) -> Draft:
        jobs = RootJobMemory(self.root, f"{WORK}/{item_id}/{JOBS}")
        amendments = self._draft_amendments(item_id)
        return Draft(item_id, payload, self.setup.recipe.seed, jobs=jobs, amendments=amendments)

    def _draft_amendments(self, item_id: str) -> Amendments:
        return read_amendments(self.root, item_id) if self._amends else {}


def _nothing() -> None:
    """Do nothing: the stage reads no input."""


def too_much_memory(memory_gb: float) -> str:
    """Return what is said of work that a worker's memory did not suffice for."""
    return (
        f"needs more than run.memory_gb = {memory_gb:g} GB of memory"
        if memory_gb
        else "needs more memory than is available"
    )


def too_large(job: RunStage, memory_gb: float) -> Rejected:
    """Return the rejection of an item for which a stage needs more memory than a worker may take."""
    said = f"{job.task.payload.title}: stage {job.stage} {too_much_memory(memory_gb)}"
    return Rejected(TOO_LARGE, f"{said}; simplify the mesh, reduce the size of its textures, or raise run.memory_gb")


class InlineExecutor:
    """Do every job at once in this process: to look at a stage with a debugger, and to test what drives it.

    Neither ``stage_timeout_s`` nor ``memory_gb`` holds here.
    """

    def __init__(self, setup: WorkerSetup, slots: int = 1):
        self._worker, self._slots = Worker(setup), slots
        self._ended: list[tuple[int, Reply]] = []

    def slots(self, needs: Resource) -> int:
        """Return how many jobs may be given at a time, the same for all resources."""
        return self._slots

    def submit(self, ticket: int, job: Job) -> None:
        """Do a job at once; ``ended`` returns its reply."""
        self._ended.append((ticket, self._worker.do(job)))

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Return what was done since the last call; sleep where that is nothing."""
        if not self._ended:
            time.sleep(timeout_s)
        ended, self._ended = self._ended, []
        return ended

    def parts(self) -> dict[int, StagePart]:
        """Return nothing: while a stage runs in this process, nobody asks."""
        return {}

    def close(self) -> None:
        """Nothing is open."""


def _line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
