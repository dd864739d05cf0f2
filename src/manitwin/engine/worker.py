"""Execution of one job in a worker process."""

from __future__ import annotations

import errno
import shutil
import time
import traceback
from dataclasses import replace
from functools import partial

from manitwin.config import Resource
from manitwin.engine.amendments import AMENDMENTS, Amendments, amendments_sha256, read_amendments
from manitwin.engine.charges import record_charges
from manitwin.engine.job_memory import RootJobMemory
from manitwin.engine.jobs import (
    Failure,
    Finish,
    Job,
    Reply,
    RunStage,
    StageRejected,
    Survey,
    SurveyReply,
    WorkerSetup,
    WriteTables,
)
from manitwin.engine.lost_charges import lost_usd
from manitwin.engine.recipe import Ending
from manitwin.engine.stage import INPUT, Draft, Stage, StagePart
from manitwin.engine.stage_runner import JOBS, StageCost, StageRun, WorkFolder, available_reads
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
"""The rejection reason if a stage exceeds a worker's memory; every recipe that can reject items defines it."""


class Worker:
    """Runs jobs one at a time; owns the stages, which are created once per kind of input."""

    def __init__(self, setup: WorkerSetup):
        self.setup, self.root = setup, DatasetRoot(setup.root_url)
        self._stages: dict[str, list[Stage]] = {}
        self._amends = self.root.exists(AMENDMENTS)

    def do(self, job: Job) -> Reply:
        """Run a job and return the reply; exceptions become a Failure, except those that end the process."""
        with record_charges() as bill:
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
        except NewerVersion as error:  # an older version must not replace any folder: stop the run
            return Failure("denied", " ".join(str(error).split()))
        except BackendError as error:
            return Failure("error", _line(error))
        except OSError as error:
            kind = "no_space" if error.errno in NO_SPACE else "error"
            return Failure(kind, _line(error))  # type: ignore[arg-type]
        except MemoryError:
            return Failure(
                "error", f"it {out_of_memory_message(self.setup.memory_gb)}; raise the limit, or use fewer --jobs"
            )
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

    def _survey(self, job: Survey) -> SurveyReply:
        identity = self.setup.recipe.identify(job.task.payload)
        ending = self._ending(identity.item_id)
        if identity.rejected is not None:
            rejected = StageRejected(identity.rejected, StageCost(0.0, 0.0, 0.0))
            return SurveyReply(identity.item_id, identity.kind, ending, rejected=rejected)
        work, draft = self._work(identity.item_id), self._draft(identity.item_id, job.task.payload)
        work.sweep()
        done: list[tuple[str, StageRun]] = []
        for stage in self.stages(identity.kind):
            found = work.find(stage, draft)
            if found is None:
                break
            done.append((stage.name, found))
        return SurveyReply(identity.item_id, identity.kind, ending, tuple(done))

    def _ending(self, item_id: str) -> Ending | None:
        recipe = self.setup.recipe
        name = f"{recipe.folder_of(item_id)}/{recipe.record}"
        try:
            amended = amendments_sha256(self._draft_amendments(item_id))
            return recipe.ending_of(self.root.read_bytes(name), amended) if self.root.exists(name) else None
        except NewerVersion as error:
            raise NewerVersion(f"{recipe.folder_of(item_id)}/{error}") from error
        except TwinError:  # not a readable record: the new folder replaces it
            return None

    def _run(self, job: RunStage) -> StageRun | StageRejected:
        stages = self.stages(job.kind)
        stage, work, draft = (
            stages[job.position],
            self._work(job.task.item_id),
            self._draft(job.task.item_id, job.task.payload),
        )
        draft.amendments = {name: each for name, each in draft.amendments.items() if name == stage.name}
        work.sweep()  # remains of a worker that died at this stage
        wanted = {name.removesuffix("?") for name in stage.reads}
        writers = {s.name for s in stages if wanted & set(s.writes)}
        work.load(draft, [d for d in job.done if d[0] in writers], {s.name: s for s in stages}, wanted)
        started, cpu_started = time.perf_counter(), time.process_time()
        reads_input = not available_reads(stage, draft.names())
        require_same = partial(self._require_same, job.task) if reads_input else _do_nothing
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
        except Rejected:  # e.g. an input file is gone; assembling does not reject by itself
            self._require_same(job.task)
            raise
        except InputChanged:
            work.delete_results()  # it is unknown which results belong to the bytes that the id stands for
            raise
        finally:
            shutil.rmtree(work.fresh, ignore_errors=True)
        if not self.setup.keep_work:
            work.delete_results()
        return ending

    def _require_same(self, task: Task) -> None:
        """Raise InputChanged if the input no longer matches the item's id."""
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


def _do_nothing() -> None:
    """Do nothing: the stage does not read the input."""


def out_of_memory_message(memory_gb: float) -> str:
    """Return the message for work that exceeded a worker's memory."""
    return (
        f"needs more than run.memory_gb = {memory_gb:g} GB of memory"
        if memory_gb
        else "needs more memory than is available"
    )


def too_large(job: RunStage, memory_gb: float) -> Rejected:
    """Return the rejection of an item for which a stage exceeded a worker's memory."""
    said = f"{job.task.payload.title}: stage {job.stage} {out_of_memory_message(memory_gb)}"
    return Rejected(TOO_LARGE, f"{said}; simplify the mesh, reduce the size of its textures, or raise run.memory_gb")


class InlineExecutor:
    """Runs each job synchronously in this process, for debugging and tests.

    ``stage_timeout_s`` and ``memory_gb`` are not enforced.
    """

    def __init__(self, setup: WorkerSetup, slots: int = 1):
        self._worker, self._slots = Worker(setup), slots
        self._ended: list[tuple[int, Reply]] = []

    def slots(self, needs: Resource) -> int:
        """Return how many jobs may be submitted at a time, the same for all resources."""
        return self._slots

    def submit(self, ticket: int, job: Job) -> None:
        """Run a job immediately; ``ended`` returns its reply."""
        self._ended.append((ticket, self._worker.do(job)))

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Return the replies since the last call; sleep for the timeout if there are none."""
        if not self._ended:
            time.sleep(timeout_s)
        ended, self._ended = self._ended, []
        return ended

    def parts(self) -> dict[int, StagePart]:
        """Return an empty dict: nothing can poll while a stage runs in this process."""
        return {}

    def close(self) -> None:
        """Do nothing: no resources are held."""


def _line(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
