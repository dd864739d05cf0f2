"""Arguments of a build: the inputs, and the configuration with overrides from a command line or call."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, Literal, TypedDict

from manitwin.config import MOST_SLOTS, BuildConfig, load_config, validate_settings
from manitwin.engine.ledger.location import CONFIG
from manitwin.errors import ConfigError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.pipeline.item import Item
from manitwin.pipeline.manifest import Notes, Turns, iterate_items, require_inputs
from manitwin.twin.dataset_root import DatasetRoot

RETIRED = ("item_timeout_s",)
"""Settings in configurations of earlier versions that did not affect twins; they are ignored."""


class Flags(TypedDict, total=False):
    """Overrides of a build's configuration; None or a missing key leaves the configuration unchanged."""

    seed: int | None
    """The random seed."""
    grippers: Iterable[str] | None
    """Names or ``.toml`` files; the grasps of the first gripper are the twin's own."""
    vlm: str | None
    """The vision-language model: ``openai:MODEL@URL``, ``anthropic:MODEL``, ``replay:FILE`` or ``rules``."""
    generator: str | None
    """The generator of meshes from photos and texts (docs/generators.md)."""
    grasper: str | None
    """The proposer of grasps (docs/served_grasps.md)."""
    matting: str | None
    """A matting network used in addition to the built-in method: ``isnet``, an ONNX file, or ``none``."""
    max_cost_usd: float | None
    """Once services have charged this sum, items that would cost more are left for another run."""
    record: str | Path | None
    """A file to which the model's answers are appended, for ``replay:FILE``."""
    require_agreement: bool
    """Verify only grasps that a second engine confirms."""
    second_opinion: Literal["all", "sample"] | None
    """Whether the second engine tries all held grasps, or a sample of 20, which gives their share with an interval."""
    quick: bool
    """Skip the second engine, robustness trials and second trials of doubtful grasps."""
    link: str | None
    """For articulated objects with locked joints: both fingertips of each grasp must touch this link."""


SAMPLE_OF_HELD = 20
"""If 20 of 20 hold, at least 84 % of all do (Wilson's interval, 95 %)."""


def with_flags(settings: BuildConfig, flags: Flags) -> BuildConfig:
    """Return the settings with the flags applied. Raises UsageError if flags contradict each other."""
    quick, agree = flags.get("quick", False), flags.get("require_agreement", False)
    if quick and agree:
        raise UsageError("--quick skips the second engine, but --require-agreement needs it; give only one of them")
    max_cost_usd, record, grippers = flags.get("max_cost_usd"), flags.get("record"), flags.get("grippers")
    if max_cost_usd is not None and not 0 < max_cost_usd < inf:
        raise UsageError(f"max_cost_usd is {max_cost_usd:g}; give more than 0")
    said = {
        "seed": flags.get("seed"), "annotator": flags.get("vlm"), "generator": flags.get("generator"),
        "grasper": flags.get("grasper"), "grippers": tuple(grippers) if grippers else None,
    }  # fmt: skip
    services = {"max_cost_usd": max_cost_usd, "record": None if record is None else Path(record).absolute()}
    update: dict[str, Any] = _given(said) | {"services": settings.services.model_copy(update=_given(services))}
    matting = flags.get("matting")
    if matting is not None:
        names = [str(Path(name).absolute()) if "." in name else name for name in map(str.strip, matting.split(","))]
        network = None if matting == "none" else ",".join(names)
        update["matting"] = settings.matting.model_copy(update={"network": network})
    if flags.get("link") is not None:
        update["grasps"] = settings.grasps.model_copy(update={"link": flags["link"]})
    if agree:
        update["second_opinion"] = settings.second_opinion.model_copy(
            update={"enabled": True, "require_agreement": True}
        )
    asked = flags.get("second_opinion")
    if asked is not None and quick:
        raise UsageError("--quick skips the second engine, but --second-opinion needs it; give only one of them")
    if asked is not None:
        sample = None if asked == "all" else SAMPLE_OF_HELD
        base = update.get("second_opinion", settings.second_opinion)
        update["second_opinion"] = base.model_copy(update={"enabled": True, "sample_of_held": sample})
    if quick:
        update["second_opinion"] = settings.second_opinion.model_copy(update={"enabled": False})
        update["robustness"] = settings.robustness.model_copy(update={"enabled": False})
        update["verify"] = settings.verify.model_copy(update={"doubts_tried_again": False})
    return validate_settings(BuildConfig, settings.model_copy(update=update).model_dump(), "the arguments")


def _given(said: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in said.items() if value is not None}


class NotTwins(UsageError):
    """A folder that was made by another command than ``build``: scenes, episodes, pictures."""


def stored_config(root: DatasetRoot) -> BuildConfig:
    """Return the configuration of a data set, or the defaults for a new one. Raises UsageError if it cannot be read."""
    if not root.exists(CONFIG):
        return BuildConfig()
    place = f"{root.url}/{CONFIG}"
    said = root.read_json(CONFIG, UsageError, remedy="give --config")
    if "kind" in said:
        kind = printable_line(str(said["kind"])[:40])
        raise NotTwins(f"{root.url}: contains {kind}, not twins; give the data set of their twins")
    try:
        return validate_settings(
            BuildConfig, {name: value for name, value in said.items() if name not in RETIRED}, place
        )
    except ConfigError as error:
        raise UsageError(f"{place}: not a configuration of this version ({error}); give --config") from error


_DECIDE_NO_TWIN = ("run", "services")
_MOST_NAMED, _MOST_SHOWN = 6, 80


def _non_default_settings(settings: BuildConfig) -> str:
    """List the settings that affect twins and differ from this version's defaults, in one line.

    They were chosen earlier, or were the defaults of the version that made the data set.
    """
    default = dict(_flat(BuildConfig().model_dump(mode="json")))
    differ = [
        f"{name} {json.dumps(value)}"
        for name, value in _flat(settings.model_dump(mode="json"))
        if name.partition(".")[0] not in _DECIDE_NO_TWIN and (name not in default or default[name] != value)
    ]
    more = f" and {len(differ) - _MOST_NAMED} more" if len(differ) > _MOST_NAMED else ""
    return ", ".join(printable_line(each, max_characters=_MOST_SHOWN) for each in differ[:_MOST_NAMED]) + more


def _flat(settings: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in settings.items():
        if isinstance(value, Mapping) and value:
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


MOST_VARIATIONS = 100_000
"""Limit per text: more than the paper's data set has of one category."""


@dataclass(frozen=True)
class BuildRequest:
    """The checked arguments of ``build``; nothing has been written. ``items`` are read, with their notes, while being iterated.

    ``out`` is the data set as given by the user.
    """

    out: str
    settings: BuildConfig
    root: DatasetRoot
    items: Iterator[Item]
    notes: Notes


def request_build(
    inputs: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    texts: Iterable[str],
    strict: bool,
    jobs: int | None,
    config: BuildConfig | str | Path | None,
    defaults: dict[str, Any],
    flags: Flags,
    count: int = 1,
    views: bool = False,
    turns_deg: Turns | None = None,
    poses: str | Path | None = None,
) -> BuildRequest:
    """Check the arguments of ``build``; ``defaults`` apply to all inputs. Raises UsageError for invalid ones."""
    if jobs is not None and not 1 <= jobs <= MOST_SLOTS:
        raise UsageError(f"jobs is {jobs:.6g}; give 1 to {MOST_SLOTS}")
    if not 1 <= count <= MOST_VARIATIONS:
        raise UsageError(f"count is {count:.6g}; give 1 to {MOST_VARIATIONS}")
    root, words = DatasetRoot(out), list(texts)
    given = [inputs] if isinstance(inputs, str | Path) else list(inputs)
    require_inputs(root, given, words)
    base = config if isinstance(config, BuildConfig) else load_config(Path(config)) if config else stored_config(root)
    settings = with_flags(base, flags)
    if jobs is not None:
        settings = settings.model_copy(update={"run": settings.run.model_copy(update={"cpu": jobs})})
    # imported here, as it takes two CPU-seconds: invalid arguments are rejected first
    from manitwin.pipeline.generator_input import make_input_check
    from manitwin.pipeline.recipe import check_names

    check_names(settings)
    notes = Notes()
    if config is None and base != BuildConfig():
        kept = _non_default_settings(base)
        which = f" (not this version's defaults: {kept})" if kept else ""
        notes.remarks.append(
            f"the settings are those that the data set was built with{which}; --config and options change them"
        )
    items = iterate_items(
        given,
        defaults,
        notes,
        words,
        strict=strict,
        count=count,
        views=views,
        turns_deg=turns_deg,
        poses=poses,
        refusal=make_input_check(settings),
    )
    return BuildRequest(str(out), settings, root, items, notes)
