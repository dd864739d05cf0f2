"""A gripper as data: a TOML file of dimensions, not code.

Grasp frame (that of GraspGen, ACRONYM and Contact-GraspNet): origin at the gripper's base link, +Z the approach direction,
X the closing direction. The finger on +X is the first one.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any, Protocol, TypeVar

from pydantic import TypeAdapter, ValidationError

from manitwin.errors import UsageError, choose_from
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.toml_file import MAX_TOML_BYTES, parse_toml
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.multi_finger import load_multi_finger
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

Kind = TypeVar("Kind")


class Gripper(Protocol):
    """The common part of all kinds of grippers.

    ``tip_depth_m`` is the fingertips' centre along +Z, ``opening_m`` the widest thing that fits, ``force_n`` the force it
    holds with.
    """

    @property
    def kind(self) -> str:
        """Its kind, one of ``KINDS``."""
        ...

    @property
    def name(self) -> str:
        """Its name in the rows of ``grasps.parquet``."""
        ...

    @property
    def sha256(self) -> str:
        """The digest of its definition."""
        ...

    @property
    def opening_m(self) -> float:
        """The widest thing that fits."""
        ...

    @property
    def tip_depth_m(self) -> float:
        """The fingertips' centre along +Z."""
        ...

    @property
    def force_n(self) -> float:
        """The force that it holds with."""
        ...

    @property
    def finger_friction(self) -> float:
        """The friction coefficient of what touches the object."""
        ...

    @property
    def source(self) -> str:
        """The source of its numbers."""
        ...

    def boxes(self, opening_m: float) -> list[PlacedBox]:
        """Return boxes around all of it, at a given opening."""
        ...

    def symbol(self, width_m: float) -> list[PlacedBox]:
        """Return few boxes that stand for it in a drawing of many grasps."""
        ...


def of_kind(gripper: Gripper, kind: type[Kind]) -> Kind:
    """Return a gripper as one of the class that is wanted; raises UsageError where it is another."""
    if not isinstance(gripper, kind):
        raise UsageError(f"gripper {gripper.name} is of the kind {gripper.kind}, not a {kind.__name__}; choose another")
    return gripper


Loader = Callable[[dict[str, Any], Path], Gripper]


def _described_by(kind: type[ParallelGripper] | type[SuctionGripper]) -> Loader:
    """Return the loader of a kind that its file describes wholly."""
    return lambda data, folder: TypeAdapter(kind).validate_python(data)


KINDS: dict[str, Loader] = {
    "parallel": _described_by(ParallelGripper),
    "suction": _described_by(SuctionGripper),
    "multi_finger": load_multi_finger,
}
"""How each kind is made of its file's content and folder."""


def shipped_grippers() -> list[str]:
    """Return the names of the grippers that come with the package."""
    return sorted(path.stem for path in _shipped_folder().iterdir() if path.suffix == ".toml")


def _shipped_folder() -> Path:
    return Path(str(resources.files("manitwin.robots.grippers") / "definitions"))


def load_gripper(name_or_path: str) -> Gripper:
    """Load a gripper by its shipped name or from a TOML file; raises UsageError naming what would be valid."""
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise UsageError(
                f"gripper file {name_or_path} is not there; give a .toml file or one of {', '.join(shipped_grippers())}"
            )
    else:
        if name_or_path not in shipped_grippers():
            raise UsageError(choose_from("gripper", name_or_path, shipped_grippers()))
        path = _shipped_folder() / f"{name_or_path}.toml"
    content = read_bytes(path, MAX_TOML_BYTES, UsageError, name=f"gripper file {path}")
    data = parse_toml(content, f"gripper file {path}", UsageError)
    kind = data.pop("kind", None)
    if kind not in KINDS:
        raise UsageError(f"gripper file {path}: {choose_from('kind', str(kind), KINDS)}")
    data["sha256"] = hashlib.sha256(content).hexdigest()
    try:
        return KINDS[kind](data, path.parent)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise UsageError(f"gripper file {path}: {where}: {first['msg']}") from error
