"""The paper's figure 2 as a list of stages, and the way of one input through it."""

from __future__ import annotations

import fcntl
import shutil
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from manitwin.assembly import assemble
from manitwin.config import BuildConfig
from manitwin.errors import BackendError, ManiTwinError, Rejected, TwinError, UsageError
from manitwin.files.sniff import sniff
from manitwin.files.source_files import MESH_SUFFIXES
from manitwin.identity import twin_id
from manitwin.models.registry import create, target
from manitwin.simulate.gripper import Gripper, load_gripper
from manitwin.stage_runner import StageCost, run_stage
from manitwin.stages.candidates import CandidatesStage
from manitwin.stages.caption import CaptionStage
from manitwin.stages.collision import CollisionStage
from manitwin.stages.finish import FinishStage
from manitwin.stages.gate import GateStage
from manitwin.stages.generate import GenerateStage
from manitwin.stages.grasps import GraspsStage
from manitwin.stages.gripper_kinds import KINDS
from manitwin.stages.mesh import MeshStage
from manitwin.stages.photo import PhotoStage
from manitwin.stages.physical import PhysicalStage
from manitwin.stages.placement import PlacementStage
from manitwin.stages.points import PointsStage
from manitwin.stages.record_grasps import RecordGraspsStage
from manitwin.stages.robustness import RobustnessStage
from manitwin.stages.second_opinion import SecondOpinionStage
from manitwin.stages.stage import Draft, Item, Stage
from manitwin.stages.verify import VerifyStage
from manitwin.stages.views import ViewsStage
from manitwin.store import RECORD, WORK, read_record, sha256_of_json
from manitwin.twin import TwinRecord

REPORT = "error.txt"
Kind = Literal["image", "text", "mesh"]
Status = Literal["accepted", "rejected", "unfinished"]


@dataclass(frozen=True)
class ItemResult:
    """What became of one item: its folder where it has one, and one line that says why."""

    item: Item
    twin_id: str
    status: Status
    detail: str
    folder: Path | None
    reused: bool = False


def check_names(config: BuildConfig) -> None:
    """Raise UsageError for a backend or gripper that is not there, before any work is begun."""
    for kind in ("generator", "annotator", "grasper", "simulator"):
        target(kind, getattr(config, kind))
    target("simulator", config.second_simulator)
    grippers = [gripper for gripper, _ in _grippers(config)]
    if config.second_opinion.require_agreement:
        _check_agreement(grippers, config)


def _check_agreement(grippers: list[Gripper], config: BuildConfig) -> None:
    """Raise UsageError where agreement is asked for and nobody could give it: what is not judged is not accepted."""
    if not config.second_opinion.enabled:
        raise UsageError("second_opinion requires agreement and is not enabled; enable it, or require none")
    alone = [gripper.name for gripper in grippers if KINDS[gripper.kind].second_simulator(config) is None]
    if alone:
        raise UsageError(
            f"agreement is required, and no second engine can try the gripper {', '.join(alone)}; leave it out, or "
            f"require none"
        )


def stages_for(kind: Kind, config: BuildConfig) -> list[Stage]:
    """Return the stages of the paper's pipeline for a kind of input, in order."""
    annotator = create("annotator", config.annotator)
    grippers = _grippers(config)
    first = grippers[0][0]
    return [
        *_generation(kind, config),
        MeshStage(config.mesh),
        ViewsStage(config.views),
        GateStage(config.gate, annotator),
        PhysicalStage(config.physical, annotator),
        CollisionStage(config.collision),
        CaptionStage(config.caption, annotator),
        CandidatesStage(config.candidates),
        PointsStage(config.points, annotator, first),
        *(stage for gripper, suffix in grippers for stage in _trials(gripper, suffix, config)),
        RecordGraspsStage(config.second_opinion, grippers),
        PlacementStage(config.placement),
        FinishStage(config.finish, first),
    ]


def _grippers(config: BuildConfig) -> list[tuple[Gripper, str]]:
    """Return the grippers with the suffixes of their artifacts' names; raises UsageError where two have one name."""
    grippers = [load_gripper(name) for name in config.grippers]
    names = [gripper.name for gripper in grippers]
    if len(set(names)) < len(names):
        raise UsageError(f"grippers {', '.join(names)}: each may be named once")
    return [(gripper, f"-{gripper.name}" if number else "") for number, gripper in enumerate(grippers)]


def _trials(gripper: Gripper, suffix: str, config: BuildConfig) -> list[Stage]:
    """Return the stages that propose and try the grasps of one gripper."""
    kind = KINDS[gripper.kind]
    simulator = create("simulator", kind.simulator(config))
    stages: list[Stage] = [
        GraspsStage(config.grasps, create("grasper", kind.grasper(config)), gripper, suffix),
        VerifyStage(config.verify, simulator, gripper, suffix),
    ]
    second = kind.second_simulator(config)
    if config.second_opinion.enabled and second is not None:
        other = create("simulator", second)
        stages.append(SecondOpinionStage(config.second_opinion, config.verify, simulator, other, gripper, suffix))
    if config.robustness.enabled:
        stages.append(RobustnessStage(config.robustness, config.verify, simulator, gripper, suffix))
    return stages


def _generation(kind: Kind, config: BuildConfig) -> list[Stage]:
    if kind == "mesh":
        return []
    photo: list[Stage] = [PhotoStage(config.matting)] if kind == "image" else []
    return [*photo, GenerateStage(config.generate, create("generator", config.generator))]


def config_sha256(config: BuildConfig) -> str:
    """Return the digest of everything in the configuration but the seed, which a twin states by itself.

    Grippers count by their content: a changed file is another configuration.
    """
    grippers = [gripper.sha256 for gripper, _ in _grippers(config)]
    return sha256_of_json({**config.model_dump(mode="json", exclude={"seed"}), "grippers": grippers})


def finished_record(folder: Path, config: BuildConfig) -> TwinRecord | None:
    """Return the record of a twin that is finished under this very configuration and seed, or None."""
    if not (folder / RECORD).is_file():
        return None
    try:
        record = read_record(folder)
    except TwinError:
        return None  # unreadable or of another version: built again
    same = (record.provenance.config_sha256, record.provenance.seed) == (config_sha256(config), config.seed)
    return record if same else None


def build_item(
    item: Item, out: Path, config: BuildConfig, on_stage: Callable[[str], None] = lambda name: None
) -> ItemResult:
    """Take one item through all stages; never raises for what the item or a backend does.

    A rejection is a result. A backend that fails, or a defect, leaves the item unfinished: what its stages have done stays in
    ``.work`` and is taken up by the next run.
    """
    identity = twin_id(item)
    place = out / identity
    done = finished_record(place, config)
    if done is not None:
        return ItemResult(item, identity, done.status, _line(done), place, reused=True)
    work = out / WORK / identity
    work.mkdir(parents=True, exist_ok=True)
    try:
        with _only_one(work):
            record = _build(item, identity, out, work, config, on_stage)
    except (BackendError, BlockingIOError) as error:
        return ItemResult(item, identity, "unfinished", str(error), None)
    except ManiTwinError as error:
        return ItemResult(item, identity, "unfinished", f"{type(error).__name__}: {error}", None)
    except Exception as error:
        report = work / REPORT
        report.write_text(traceback.format_exc())
        detail = f"a defect in manitwin: {type(error).__name__}: {error}; the traceback is in {report}"
        return ItemResult(item, identity, "unfinished", " ".join(detail.split()), None)
    return ItemResult(item, identity, record.status, _line(record), place)


@contextmanager
def _only_one(work: Path) -> Iterator[None]:
    """Hold a lock that ends with the process, so that two runs do not build one twin at a time."""
    with (work / "lock").open("w") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise BlockingIOError(f"another run is building {work.name} now; wait for it, then run again") from error
        for stale in work.glob("*/.*"):  # a stage that was cut off in the middle
            shutil.rmtree(stale, ignore_errors=True)
        (work / REPORT).unlink(missing_ok=True)
        yield


def _build(
    item: Item, identity: str, out: Path, work: Path, config: BuildConfig, on_stage: Callable[[str], None]
) -> TwinRecord:
    draft = Draft(identity, item, config.seed)
    costs: dict[str, StageCost] = {}
    ran: list[Stage] = []
    rejected: Rejected | None = None
    kind = _claimed_kind(item)
    try:
        if item.file is not None:
            kind = sniff(Path(item.file)).kind
        for stage in stages_for(kind, config):
            on_stage(stage.name)
            ran.append(stage)
            costs[stage.name] = run_stage(stage, draft, work)
    except Rejected as answer:
        rejected = answer
    return assemble(
        draft,
        kind=kind,
        stages=ran,
        costs=costs,
        config_sha256=config_sha256(config),
        rejected=rejected,
        rejecting_stage=ran[-1].name if ran else "input",
        fresh=out / WORK / f"{identity}.finished",
        place=out / identity,
    )


def _claimed_kind(item: Item) -> Kind:
    """Return what an input claims to be: for a file, by its suffix."""
    if item.file is None:
        return "text"
    return "mesh" if Path(item.file).suffix.lower() in MESH_SUFFIXES else "image"


def _line(record: TwinRecord) -> str:
    if record.rejection is not None:
        return f"{record.rejection.reason}: {record.rejection.detail}"
    grasps = record.grasps
    return f"{grasps.verified} of {grasps.simulated} grasps verified" if grasps else ""
