"""The names that options know: checked before anything heavy is imported, and what a shell completes.

What is written out here stands in modules that take seconds to import; a test keeps both the same.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import typer

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.missing_path import missing_path_message


@dataclass(frozen=True)
class Choices:
    """The valid values of an option: ``check`` is its callback, ``complete`` what a shell offers.

    ``listed`` values are several by commas. ``spec`` values are names before ``:`` or ``@``. A value with the suffix
    ``or_file`` is the name of a file, and checked by whoever reads it. Where an option may be repeated, each is named once.
    """

    kind: str
    find: Callable[[], Iterable[str]]
    listed: bool = False
    spec: bool = False
    or_file: str | None = None

    def option(self, *names: str, **more: Any) -> Any:
        """Return ``typer.Option(*names, **more)`` of these values."""
        return typer.Option(*names, callback=self.check, autocompletion=self.complete, **more)

    def argument(self, **more: Any) -> Any:
        """Return ``typer.Argument(**more)`` of these values."""
        return typer.Argument(callback=self.check, autocompletion=self.complete, **more)

    def check(self, value: Any) -> Any:
        """Return the value, or the values, of the option; raises UsageError naming the nearest valid one."""
        given = [] if value is None else [value] if isinstance(value, str) else list(value)
        for each in given:
            for name in each.lower().split(",") if self.listed else [each]:
                self._check_one(name.strip())
        if len(set(given)) < len(given):
            raise UsageError(f"{self.kind}s {', '.join(given)}: name each only once")
        return value

    def complete(self, incomplete: str) -> list[str]:
        """Return the values that begin as what was typed; of a list, with what stands before the last comma."""
        before, comma, last = incomplete.rpartition(",") if self.listed else ("", "", incomplete)
        taken = before.split(",") if comma else []
        return [f"{before}{comma}{name}" for name in self.find() if name.startswith(last) and name not in taken]

    def _check_one(self, name: str) -> None:
        if self.or_file is not None and name.endswith(self.or_file):
            return
        if self.spec:
            name = name[: min((name.index(mark) for mark in ":@" if mark in name), default=len(name))]
        valid = list(self.find())
        if (name or not self.listed) and name not in valid:
            also = f", or a {self.or_file} file" if self.or_file is not None else ""
            raise UsageError(unknown_name_message(self.kind, name, valid) + also)


def _fixed_names(*names: str) -> Callable[[], Iterable[str]]:
    return lambda: names


def _backends(kind: str) -> Callable[[], Iterable[str]]:
    def find() -> Iterable[str]:
        from manitwin.models.registry import backends

        return sorted(backends().get(kind, {}))

    return find


def _packaged_toml_names(*folders: str) -> Callable[[], Iterable[str]]:
    """Return a search for the TOML files of folders of this package."""

    def find() -> Iterable[str]:
        files = (file for folder in folders for file in (resources.files("manitwin") / folder).iterdir())
        return sorted(Path(file.name).stem for file in files if file.name.endswith(".toml"))

    return find


UNITS = Choices("units", _fixed_names("m", "cm", "mm", "none", "auto"))
EVALUATIONS = Choices("evaluation", _fixed_names("annotations", "generation", "grasps"))
UP = Choices("up", _fixed_names("y", "z", "auto"))
SECOND_OPINIONS = Choices("second opinion", _fixed_names("all", "sample"))
EXECUTORS = Choices("executor", _fixed_names("local", "ray", "inline"))
ANNOTATORS = Choices("annotator", _backends("annotator"), spec=True)
PROPOSERS = Choices("model", _fixed_names("none", "openai", "anthropic", "replay"), spec=True)
GENERATORS = Choices("generator", _backends("generator"), spec=True)
GRASPERS = Choices("grasper", _backends("grasper"), spec=True)
GRIPPERS = Choices("gripper", _packaged_toml_names("robots/grippers/definitions"), or_file=".toml")
ROBOTS = Choices("robot", _packaged_toml_names("robots/definitions", "robots/two_arm_definitions"), or_file=".toml")
SKILLS = Choices(
    "skill",
    _fixed_names(
        "pick_place",
        "place_on",
        "place_in",
        "stack",
        "left_of",
        "right_of",
        "behind",
        "in_front_of",
        "near",
        "away_from",
        "upright",
        "lift",
        "hang",
        "insert",
        "pour",
        "press",
        "strike",
        "push",
        "stir",
        "wipe",
        "cut_motion",
        "aim",
        "handover",
    ),
)
SURFACES = Choices("surface", _fixed_names("table", "shelf", "tray"))
CLUTTER = Choices("clutter", _fixed_names("sparse", "medium", "dense"))
CAMERAS = Choices("camera", _fixed_names("front", "side", "top", "wrist"), listed=True)
CODECS = Choices("codec", _fixed_names("av1", "mpeg4", "vp9"))
RATES_HZ = Choices("rate", _fixed_names("20", "10", "5"))
EPISODE_FORMATS = Choices("format", _fixed_names("lerobot", "maniskill"), listed=True)
EXPORT_FORMATS = Choices("format", lambda: ["all", *_backends("exporter")()], listed=True)
IMPORT_FORMATS = Choices(
    "format",
    _fixed_names("auto", "twin", "urdf", "mjcf", "sdf", "usd", "robotwin", "manitwin100k", "embodiedgen", "gso"),
)
SEGMENTATION_FORMATS = Choices("format", _fixed_names("coco", "coco-panoptic", "cityscapes", "bop", "pointcloud"))
VQA_FORMATS = Choices("format", _fixed_names("llava", "parquet", "webdataset"))
POINT_CONVENTIONS = Choices("convention of points", _fixed_names("unit", "robopoint", "roborefer", "pixel", "thousand"))
AUDIT_FORMATS = Choices("format", _fixed_names("text", "json", "sarif"))
AUDIT_ENGINES = Choices("engine", _fixed_names("mujoco", "sapien", "pybullet"), listed=True)
AUDIT_ENGINE = Choices("engine", _fixed_names("mujoco", "pybullet", "sapien", "physx", "gazebo"))
QUERY_FORMATS = Choices("format", _fixed_names("table", "csv", "json", "ids"))
TABLES = Choices("table", _fixed_names("twins", "points", "grasps", "placements", "rejections", "stages"))
ENDED_STATES = Choices("state", _fixed_names("failed", "rejected"))
SERVED_KINDS = Choices("thing to look at", _fixed_names("vlm", "generator", "grasper"))
MATTING = Choices("matting", _fixed_names("none", "isnet", "u2net"), listed=True, or_file=".onnx")
WEIGHTS = Choices("weights", _fixed_names("isnet", "u2net"))
MODEL_ACTIONS = Choices("action", _fixed_names("list", "add"))
SHELLS = Choices("shell", _fixed_names("bash", "zsh", "fish"))
REHEARSALS = Choices(
    "server",
    _fixed_names("openai", "anthropic", "rodin", "tripo", "meshy", "hunyuan3d", "fal", "graspgen", "graspgenx", "pose"),
)


LARGEST_COUNT = 10**9
LARGEST_COST_USD = 1e9
LARGEST_SIDE_M = 1e3


def count_callback(what: str, most: int = LARGEST_COUNT) -> Callable[[Any], Any]:
    """Return the callback of a number of which at least one is asked for, and no more than ``most``."""

    def check(value: int | None) -> int | None:
        if value is not None and value < 1:
            raise UsageError(f"{what} is {_number(value)}; give 1 or more")
        if value is not None and value > most:
            raise UsageError(f"{what} is {_number(value)}; give at most {most}")
        return value

    return check


def amount_callback(option: str, most: float) -> Callable[[Any], Any]:
    """Return the callback of an amount above 0, and no more than ``most``."""

    def check(value: float | None) -> float | None:
        if value is not None and not 0 < value <= most:  # NaN is neither
            raise UsageError(f"{option} {value:g}: give more than 0, at most {most:g}")
        return value

    return check


def _number(value: int) -> str:
    return str(value) if abs(value) < 10**20 else f"about {value:.0e}" if abs(value) < 10**300 else "too large"


def settings_file(value: Path | None) -> Path | None:
    """Return the path of a TOML file that is there; a callback."""
    if value is not None and not os.path.exists(value):
        raise UsageError(f"{value}: not found; give a TOML file of settings")
    if value is not None and os.path.isdir(value):
        raise UsageError(f"{value}: is a folder; give a TOML file of settings")
    return value


def existing_path_callback(remedy: str) -> Callable[[Any], Any]:
    """Return the callback of places that must be there: files and folders, or URLs, which are not asked."""

    def check(value: Any) -> Any:
        for place in [] if value is None else value if isinstance(value, list | tuple) else [value]:
            if "://" not in str(place) and not os.path.exists(place):
                raise UsageError(f"{place}: {missing_path_message(str(place))}; give {remedy}")
        return value

    return check


def check_new_folder(value: Any) -> Any:
    """Return a folder that can be made and written and has nothing in it yet; a callback."""
    if value:
        from manitwin.formats.output_folder import require_new_folder

        check_output_folder(value)
        require_new_folder(Path(value))
    return value


def check_output_folder(value: Any) -> Any:
    """Return a folder that can be made and written, or a URL, which is not asked; a callback."""
    if value and "://" not in str(value):
        from manitwin.formats.output_folder import require_writable_folder

        require_writable_folder(Path(value))
    return value
