"""The list of stages (paper, figure 2), and the recipe for the engine."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import cast

from manitwin.config import BuildConfig, SourceConfig
from manitwin.engine.folder_recipe import FolderRecipe
from manitwin.engine.recipe import Ending, Identity, Tables
from manitwin.engine.stage import INPUT, Draft, PaidStage, Stage
from manitwin.engine.stage_runner import StageCost
from manitwin.errors import InputChanged, Rejected, UsageError
from manitwin.models.annotators.imported_annotations import ImportedAnnotator
from manitwin.models.annotators.protocol import Annotator
from manitwin.models.matting.learned import Network, find_networks, require_working
from manitwin.models.registry import create, target, without_url
from manitwin.physics.confirmed_trial import ConfirmedTrial
from manitwin.pipeline.assembly import assemble, name_hint
from manitwin.pipeline.candidates import CandidatesStage
from manitwin.pipeline.caption import CaptionStage
from manitwin.pipeline.collision import CollisionStage
from manitwin.pipeline.finish import FinishStage
from manitwin.pipeline.gate import GateStage
from manitwin.pipeline.generate import GenerateStage
from manitwin.pipeline.generator_input import chosen_generator
from manitwin.pipeline.grasps import GraspsStage
from manitwin.pipeline.gripper_kinds import KINDS
from manitwin.pipeline.input_kind import KINDS_OF_INPUT, Kind, claimed_kind, kind_of
from manitwin.pipeline.item import Item, require_readable_size, twin_id
from manitwin.pipeline.mesh import MeshStage
from manitwin.pipeline.naming import NameStage
from manitwin.pipeline.parts import PartsStage
from manitwin.pipeline.photo import PhotosStage, PhotoStage
from manitwin.pipeline.physical import PhysicalStage
from manitwin.pipeline.placement import PlacementStage
from manitwin.pipeline.point_trials import PointTrialsStage
from manitwin.pipeline.points import PointsStage
from manitwin.pipeline.record_grasps import RecordGraspsStage
from manitwin.pipeline.robustness import RobustnessStage
from manitwin.pipeline.second_opinion import SecondOpinionStage
from manitwin.pipeline.stage_order import place_in_pipeline
from manitwin.pipeline.suspicious_size import unusual_size_hint
from manitwin.pipeline.verify import VerifyStage
from manitwin.pipeline.views import ViewsStage
from manitwin.robots.grippers.gripper import Gripper, load_gripper
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.integrity import find_size_damage
from manitwin.twin.record import StageProvenance, TwinRecord
from manitwin.twin.store import RECORD, parse_record, sha256_of_json

RUN = logging.getLogger("manitwin.run")
_STAGES_NAMED = 4
OF_TEMPLATE = "template:"
"""Prefix of a generator's model name if a template made the object."""


def check_names(config: BuildConfig) -> None:
    """Raise UsageError for an unavailable backend or gripper, before any work starts."""
    for kind in ("generator", "annotator", "grasper", "simulator"):
        create(kind, getattr(config, kind), config)
    target("simulator", config.second_simulator)
    grippers = [gripper for gripper, _ in _grippers(config)]
    if config.second_opinion.require_agreement:
        _check_agreement(grippers, config)
    for network in _networks(config):
        require_working(network)


def log_choices(config: BuildConfig) -> None:
    """Log the chosen backends, and which of them are defaults."""
    default = BuildConfig()
    RUN.info("configuration %s, seed %d", config_sha256(config), config.seed)
    for name in ("generator", "annotator", "grasper", "simulator", "second_simulator", "grippers"):
        chosen = getattr(config, name)
        why = "the default" if chosen == getattr(default, name) else "asked for"
        RUN.info("%s: %s (%s)", name, chosen if isinstance(chosen, str) else ", ".join(chosen), why)


def _check_agreement(grippers: list[Gripper], config: BuildConfig) -> None:
    """Raise UsageError if agreement is required but cannot be judged, as grasps are not accepted unjudged."""
    if not config.second_opinion.enabled:
        raise UsageError("second_opinion requires agreement and is not enabled; enable it, or require none")
    if config.second_opinion.sample_of_held is not None:
        raise UsageError(
            "second_opinion requires agreement of every grasp and tries a sample; try all, or require none"
        )
    alone = [gripper.name for gripper in grippers if KINDS[gripper.kind].second_simulator(config) is None]
    if alone:
        raise UsageError(
            f"agreement is required, and no second engine can try the gripper {', '.join(alone)}; leave it out, or "
            f"require none"
        )


def stages_for(kind: Kind, config: BuildConfig) -> list[Stage]:
    """Return the pipeline's stages for a kind of input, in order."""
    own = create("annotator", config.annotator, config)
    annotator = ImportedAnnotator(own)
    grippers = _grippers(config)
    first = grippers[0][0]
    return [
        *_generation(kind, config, own),
        MeshStage(config.mesh),
        ViewsStage(config.views, annotator.picture_px),
        *([NameStage(config.naming)] if kind == "mesh" else []),
        GateStage(config.gate, annotator),
        PhysicalStage(config.physical, annotator),
        CollisionStage(config.collision),
        PlacementStage(config.placement),
        CaptionStage(annotator),
        CandidatesStage(config.candidates),
        PointsStage(annotator, first),
        PartsStage(),
        *(stage for gripper, suffix in grippers for stage in _trials(gripper, suffix, config)),
        RecordGraspsStage(config.second_opinion, grippers, config.grasps.link),
        FinishStage(first),
    ]


def _grippers(config: BuildConfig) -> list[tuple[Gripper, str]]:
    """Return the grippers with the suffixes of their artifact names. Raises UsageError if two have the same name."""
    grippers = [load_gripper(name) for name in config.grippers]
    names = [gripper.name for gripper in grippers]
    if len(set(names)) < len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise UsageError(
            f"grippers {', '.join(names)}: grasps are identified by the gripper name, so names must be unique; name"
            f" {', '.join(twice)} once, or give one of two files another name"
        )
    return [(gripper, f"-{gripper.name}" if number else "") for number, gripper in enumerate(grippers)]


def _trials(gripper: Gripper, suffix: str, config: BuildConfig) -> list[Stage]:
    """Return the stages that propose and try the grasps of one gripper."""
    kind = KINDS[gripper.kind]
    simulator = create("simulator", kind.simulator(config), config)
    grasper = create("grasper", kind.grasper(config), config)
    second = kind.second_simulator(config)
    other = None if second is None else create("simulator", second, config)
    trial = simulator if other is None else ConfirmedTrial(simulator, other)
    stages: list[Stage] = [
        GraspsStage(config.grasps, grasper, gripper, suffix),
        VerifyStage(config.verify, trial, gripper, suffix),
    ]
    if not suffix:
        stages.append(PointTrialsStage(config.grasps, config.verify, grasper, trial, gripper))
    if config.second_opinion.enabled and other is not None:
        stages.append(SecondOpinionStage(config.second_opinion, config.verify, simulator, other, gripper, suffix))
    if config.robustness.enabled:
        stages.append(RobustnessStage(config.robustness, config.verify, simulator, gripper, suffix))
    return stages


def _generation(kind: Kind, config: BuildConfig, annotator: Annotator) -> list[Stage]:
    if kind == "mesh":
        return []
    photo: list[Stage] = []
    if kind != "text":
        cut_out = PhotosStage if kind == "photos" else PhotoStage
        photo = [cut_out(config.matting, _networks(config)), NameStage(config.naming)]
    generator = chosen_generator(config, annotator)
    return [*photo, GenerateStage(config.generate, generator, config.services.submit_again)]


def _networks(config: BuildConfig) -> tuple[Network, ...]:
    return () if config.matting.network is None else find_networks(config.matting.network)


def config_sha256(config: BuildConfig) -> str:
    """Return the digest of everything in the configuration that affects a twin, except the seed, which a twin states separately.

    Grippers enter by content: a changed file is another configuration.
    """
    decides = config.model_dump(mode="json", exclude={"seed", "services", "run"})
    decides["grippers"] = [gripper.sha256 for gripper, _ in _grippers(config)]
    decides |= {kind: without_url(decides[kind]) for kind in ("generator", "annotator", "grasper")}
    networks = _networks(config)
    if networks:
        decides["matting"]["network"] = ",".join(network.sha256 for network in networks)
    else:
        del decides["matting"]["network"]
    if config.source == SourceConfig():  # omitted at its default, to keep digests from before the setting existed
        del decides["source"]
    if config.second_opinion.sample_of_held is None:
        del decides["second_opinion"]["sample_of_held"]
    if config.grasps.link is None:
        del decides["grasps"]["link"]
    del decides["vlm"]["prompts"]  # their content is part of the model of each stage that uses them
    return sha256_of_json(decides)


def is_current(record: TwinRecord, config: BuildConfig) -> bool:
    """Return whether this configuration, seed and version of the stages would make the same record."""
    return not _otherwise_set(record, config) and not _other_stages(record, config)


def describe_differences(record: TwinRecord, config: BuildConfig) -> str:
    """Describe how configuration, seed and stages differ from those that made a twin; empty if they do not."""
    said = _otherwise_set(record, config)
    if stages := _other_stages(record, config):
        more = f" and {len(stages) - _STAGES_NAMED} more stages" if len(stages) > _STAGES_NAMED else ""
        said.append(f"by other versions of {', '.join(stages[:_STAGES_NAMED])}{more}")
    return " and ".join(said)


def _otherwise_set(record: TwinRecord, config: BuildConfig) -> list[str]:
    seed = [] if record.provenance.seed == config.seed else ["with another seed"]
    return seed + ([] if record.provenance.config_sha256 == config_sha256(config) else ["with other settings"])


def _other_stages(record: TwinRecord, config: BuildConfig) -> list[str]:
    """Return the stages that would run differently now, or that would be added, in pipeline order."""
    now = {stage.name: _decided_by(stage) for stage in stages_for(record.source.kind, config)}
    ran = {name: _decided_by(stage) for name, stage in record.provenance.stages.items()}
    if "generate" in ran and "generate" in now and now["generate"][2] is None:
        ran["generate"] = (*ran["generate"][:2], None)  # this generator reports its model only afterwards
    names = {*ran, *now} if record.status == "accepted" else ran.keys()
    return sorted((name for name in names if now.get(name) != ran.get(name)), key=place_in_pipeline)


def _decided_by(stage: Stage | StageProvenance) -> tuple[str, str, str | None]:
    return stage.version, stage.backend, stage.model


@dataclass(frozen=True)
class TwinRecipe(FolderRecipe[TwinRecord]):
    """The engine's recipe for a twin. ``tables`` are the index tables updated during a run."""

    payload = Item
    record = RECORD

    config: BuildConfig
    tables: Tables | None = None

    @cached_property
    def sha256(self) -> str:
        """The digest of the configuration, seed and all stages."""
        stages = [
            [kind, stage.name, stage.version, stage.backend, stage.model]
            for kind in KINDS_OF_INPUT
            for stage in stages_for(kind, self.config)
        ]
        return sha256_of_json([config_sha256(self.config), self.config.seed, stages])

    @property
    def seed(self) -> int:
        """The random seed."""
        return self.config.seed

    def folder_of(self, item_id: str) -> str:
        """Return the path of the twin's folder relative to the data set's root."""
        return twin_name(item_id)

    def damage(self, root: DatasetRoot, item_id: str) -> str | None:
        """Return what is wrong with a twin's folder, judged by file sizes; None if nothing is."""
        return find_size_damage(root, twin_name(item_id))

    def identify(self, payload: Item) -> Identity:
        """Return the id and kind of an input from the content of its files.

        Raises InputChanged if a file is missing.
        """
        if payload.file is None:
            return Identity(twin_id(payload), "text")
        identity = None
        try:
            identity = twin_id(payload)
            for file in payload.files:
                require_readable_size(Path(file))
            return Identity(identity, kind_of(payload))
        except (OSError, Rejected) as answer:
            gone = next((Path(file) for file in payload.files if not Path(file).exists()), None)
            if gone is not None:
                raise InputChanged(f"{gone.name}: was removed; put it back, then rerun the same command") from answer
            if identity is None or not isinstance(answer, Rejected):
                raise
            return Identity(identity, claimed_kind(payload), answer)

    def stages(self, kind: str) -> list[Stage]:
        """Return the pipeline's stages for a kind of input, in order."""
        return stages_for(cast(Kind, kind), self.config)

    def parse(self, record: bytes) -> TwinRecord:
        """Parse a twin's record. Raises TwinError if it is unreadable or of an unknown version; the twin is then built again."""
        return parse_record(record)

    def is_current(self, record: TwinRecord) -> bool:
        """Return whether this recipe would make the same twin."""
        return is_current(record, self.config)

    def amended_sha256(self, record: TwinRecord) -> str | None:
        """Return the digest of the amendments with which a twin was made."""
        return record.provenance.amendments_sha256

    def ending(self, record: TwinRecord) -> Ending:
        """Return how the item of a twin's record ended."""
        return ending_of(record)

    def write(
        self, draft: Draft, kind: str, costs: dict[str, StageCost], rejected: Rejected | None, stage: str, fresh: Path
    ) -> TwinRecord:
        """Write the twin's folder."""
        names = [*costs, *([stage] if rejected is not None and stage != INPUT else [])]
        return assemble(
            draft,
            kind=kind,
            stages=[s for s in self.stages(kind) if s.name in names],
            costs=costs,
            config_sha256=config_sha256(self.config),
            rejected=rejected,
            rejecting_stage=stage,
            fresh=fresh,
            keep_source=self.config.source.keep == "copy",
        )


def ending_of(record: TwinRecord) -> Ending:
    """Return how the item of a twin's record ended."""
    reason = record.rejection.reason if record.rejection is not None else None
    if record.rejection is not None:
        detail = record.rejection.detail
    else:
        detail = f"{record.grasps.verified} of {record.grasps.simulated} grasps verified" if record.grasps else ""
    if (meant := _template_category(record)) is not None:
        detail += f"; taken as a {meant}"
    if record.provenance.rehearsed:
        detail += "; a rehearsal"
    hints = [hint for hint in (unusual_size_hint(record), name_hint(record)) if hint is not None]
    return Ending(record.status, record.revision, reason, detail, "; ".join(hints) or None)


def _template_category(record: TwinRecord) -> str | None:
    """Return the category that a template assigned to a text, if the text does not contain it: a king as a chess king."""
    model = record.provenance.stages["generate"].model if "generate" in record.provenance.stages else None
    if record.source.kind != "text" or model is None or not model.startswith(OF_TEMPLATE):
        return None
    category, said = model.removeprefix(OF_TEMPLATE).partition(",")[0], (record.source.prompt or "").casefold()
    return None if category in " ".join(said.split()) else category


def estimate_usd(config: BuildConfig) -> dict[str, float]:
    """Return the approximate charge for a twin in USD, by kind of input."""
    return {kind: expected_usd(stages_for(kind, config)) for kind in KINDS_OF_INPUT}


def expected_usd(stages: list[Stage]) -> float:
    """Return the approximate charge for a twin that passes through these stages, in USD."""
    return sum(stage.expected_usd for stage in stages if isinstance(stage, PaidStage))
