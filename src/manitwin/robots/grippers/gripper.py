"""Grippers as data: a TOML file of dimensions for each gripper, without code.

Grasp frame (that of GraspGen, ACRONYM and Contact-GraspNet): origin at the gripper's base link, +Z the approach direction, X
the closing direction. The first finger is the one on +X.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any, Protocol, TypeVar

from pydantic import TypeAdapter, ValidationError

from manitwin.errors import UsageError, unknown_name_message
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.toml_file import MAX_TOML_BYTES, parse_toml
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.box_checks import check_cup, check_jaws
from manitwin.robots.grippers.multi_finger_file import load_multi_finger
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

Kind = TypeVar("Kind")


class Gripper(Protocol):
    """Interface common to all kinds of grippers.

    ``tip_depth_m`` is the coordinate of the fingertips' centre along +Z, ``opening_m`` the largest width that fits,
    ``force_n`` the holding force.
    """

    @property
    def kind(self) -> str:
        """The kind, one of ``KINDS``."""
        ...

    @property
    def name(self) -> str:
        """The name in the rows of ``grasps.parquet``."""
        ...

    @property
    def sha256(self) -> str:
        """The digest of the definition."""
        ...

    @property
    def opening_m(self) -> float:
        """The largest width that fits."""
        ...

    @property
    def tip_depth_m(self) -> float:
        """The coordinate of the fingertips' centre along +Z."""
        ...

    @property
    def force_n(self) -> float:
        """The holding force."""
        ...

    @property
    def finger_friction(self) -> float:
        """The friction coefficient of the surfaces that touch the object."""
        ...

    @property
    def source(self) -> str:
        """The source of the dimensions."""
        ...

    def boxes(self, opening_m: float) -> list[PlacedBox]:
        """Return boxes that enclose the whole gripper at a given opening."""
        ...

    def symbol(self, width_m: float) -> list[PlacedBox]:
        """Return a few boxes that represent the gripper in drawings of many grasps."""
        ...


def require_kind(gripper: Gripper, kind: type[Kind]) -> Kind:
    """Return the gripper if it is of class ``kind``; raises UsageError otherwise."""
    if not isinstance(gripper, kind):
        raise UsageError(f"gripper {gripper.name} is of the kind {gripper.kind}, not a {kind.__name__}; choose another")
    return gripper


ROBOT_DESCRIPTIONS = (".urdf", ".xacro", ".xml", ".sdf", ".mjcf")

Loader = Callable[[dict[str, Any], Path, bool], Gripper]


def _load_jaws(data: dict[str, Any], folder: Path, checked: bool) -> ParallelGripper:
    jaws = TypeAdapter(ParallelGripper).validate_python(data)
    if checked:
        check_jaws(jaws)
    return jaws


def _load_cup(data: dict[str, Any], folder: Path, checked: bool) -> SuctionGripper:
    cup = TypeAdapter(SuctionGripper).validate_python(data)
    if checked:
        check_cup(cup)
    return cup


KINDS: dict[str, Loader] = {
    "parallel": _load_jaws,
    "suction": _load_cup,
    "multi_finger": load_multi_finger,
}
"""Loaders by kind: each takes the file's content, its folder, and whether to check shapes against dimensions."""


def shipped_grippers() -> list[str]:
    """Return the names of the grippers in the package."""
    return sorted(path.stem for path in _shipped_folder().iterdir() if path.suffix == ".toml")


def _shipped_folder() -> Path:
    return Path(str(resources.files("manitwin.robots.grippers") / "definitions"))


def load_gripper(name_or_path: str | Path, *, checked: bool = True) -> Gripper:
    """Load a gripper by its shipped name or from a TOML file; raises UsageError naming the problem and valid values.

    With ``checked`` False the shapes are not compared with the dimensions, and the openings of a hand's postures may be
    missing. Such a gripper is only suitable for display.
    """
    name_or_path = str(name_or_path)
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise UsageError(
                f"gripper file {name_or_path} does not exist; give a .toml file or one of"
                f" {', '.join(shipped_grippers())}"
            )
    elif name_or_path.endswith(ROBOT_DESCRIPTIONS):
        raise UsageError(
            f"gripper {name_or_path} is the description of a robot; write a .toml file of the gripper beside it, of the kind"
            " multi_finger, which names a URDF, or parallel or suction, which are boxes and numbers"
        )
    else:
        if name_or_path not in shipped_grippers():
            raise UsageError(f"{unknown_name_message('gripper', name_or_path, shipped_grippers())}, or a .toml file")
        path = _shipped_folder() / f"{name_or_path}.toml"
    content = read_bytes(path, MAX_TOML_BYTES, UsageError, name=f"gripper file {path}")
    data = parse_toml(content, f"gripper file {path}", UsageError)
    kind = data.pop("kind", None)
    if kind not in KINDS:
        raise UsageError(f"gripper file {path}: {unknown_name_message('kind', str(kind), KINDS)}")
    data["sha256"] = hashlib.sha256(content).hexdigest()
    try:
        gripper = KINDS[kind](data, path.parent, checked)
        if gripper.name in shipped_grippers():
            _check_name(gripper.name, path, content)
        return gripper
    except ValidationError as error:
        raise UsageError(f"gripper file {path}: {_first_of(error)}") from error
    except ValueError as error:  # raised by a check
        raise UsageError(f"gripper file {path}: {error}") from error


def _check_name(name: str, path: Path, content: bytes) -> None:
    """Raise ValueError if a different gripper has a shipped one's name, by which exports, pages and robots refer to it."""
    shipped = _shipped_folder() / f"{name}.toml"
    if content != read_bytes(shipped, MAX_TOML_BYTES, UsageError, name=str(shipped)):
        raise ValueError(f"name: {name!r} is the name of a shipped gripper; choose another name")


def _first_of(error: ValidationError) -> str:
    """Return the first validation error, unknown keys before missing ones, because a misspelt key is both."""
    complaints = error.errors()
    unknown = [each for each in complaints if each["type"] in ("extra_forbidden", "unexpected_keyword_argument")]
    missing = [str(each["loc"][-1]) for each in complaints if each["type"] == "missing"]
    first = (unknown or complaints)[0]
    where = ".".join(str(part) for part in first["loc"])
    if unknown:
        lacks = f"; these are missing: {', '.join(missing)}" if missing else ""
        return f"{where}: not a key of this kind{lacks}; correct or remove it"
    if missing:
        return f"it lacks {', '.join(missing)}; give {'it' if len(missing) == 1 else 'them'}"
    return f"{where}: {first['msg'].removeprefix('Value error, ')}"
