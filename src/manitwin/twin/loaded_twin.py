"""A finished twin in memory: meshes, grasps as arrays, and the way into a SAPIEN scene."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet
import trimesh

from manitwin.errors import TwinError, UsageError
from manitwin.formats.glb import read_glb
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import Physical, TwinRecord
from manitwin.twin.store import RECORD, read_record


@dataclass(frozen=True)
class Grasps:
    """Grasps of one gripper as arrays; poses are ``gripper_to_object (N, 4, 4)`` in the grasp frame (+Z approach, X closing).

    ``verified (N,) bool``, ``width_m (N,)``, ``depth_m (N,)``, ``score (N,)``, ``outcome (N,) str``; the rest by name in
    ``columns``.
    """

    gripper_to_object: np.ndarray
    width_m: np.ndarray
    depth_m: np.ndarray
    score: np.ndarray
    verified: np.ndarray
    outcome: np.ndarray
    columns: dict[str, list[Any]]

    def __len__(self) -> int:
        return len(self.gripper_to_object)


class Twin:
    """A twin folder, read when asked for. All geometry is in the object frame: metres, +Z up, standing on z = 0."""

    def __init__(self, folder: str | Path, verify: bool = False):
        """Read the record; with ``verify``, check every file's digest. Raises TwinError."""
        self.folder = Path(folder)
        self.record: TwinRecord = read_record(self.folder, verify=verify)

    def __repr__(self) -> str:
        return f"Twin({self.record.twin_id}, {self.record.name!r}, {self.record.status})"

    @property
    def physical(self) -> Physical:
        """The physical properties; raises TwinError for a rejected twin."""
        if self.record.physical is None:
            reason = self.record.rejection.detail if self.record.rejection else "no physical properties"
            raise TwinError(f"{self.folder}: this twin was rejected ({reason}); only its record and source can be read")
        return self.record.physical

    @cached_property
    def visual(self) -> list[trimesh.Trimesh]:
        """The textured meshes, in the object frame (Z-up)."""
        self.physical  # noqa: B018  a rejected twin has no meshes: say so
        return read_glb(self.folder / "visual.glb")

    @cached_property
    def hulls(self) -> list[trimesh.Trimesh]:
        """The convex collision hulls."""
        self.physical  # noqa: B018
        files = sorted((self.folder / "collision").glob("hull_*.obj"))
        return [trimesh.load_mesh(path, process=False) for path in files]

    def rigid_body(self) -> RigidBody:
        """Return the hulls with the twin's mass properties and friction, as simulations take them."""
        physical = self.physical
        return RigidBody(
            hulls=tuple(np.asarray(hull.vertices) for hull in self.hulls),
            mass_kg=physical.mass_kg.value,
            center_of_mass_m=np.array(physical.center_of_mass_m),
            inertia_kg_m2=np.array(physical.inertia_kg_m2),
            friction_static=physical.friction_static.value,
            friction_dynamic=physical.friction_dynamic.value,
        )

    def grasps(self, verified_only: bool = True, gripper: str | None = None) -> Grasps:
        """Return the grasps of a gripper (by default the one that the twin was verified with).

        Leaves out the unfiltered sample and the jittered controls.
        """
        self.physical  # noqa: B018
        table = pyarrow.parquet.read_table(self.folder / "grasps.parquet").to_pydict()
        wanted = gripper or (self.record.grasps.gripper if self.record.grasps else "")
        keep = [
            i
            for i, (name, proposer, held) in enumerate(
                zip(table["gripper"], table["proposer"], table["verified"], strict=True)
            )
            if name == wanted and not proposer.endswith((":unfiltered", ":jittered")) and (held or not verified_only)
        ]
        columns = {name: [values[i] for i in keep] for name, values in table.items()}
        rotations = rotation_from_quaternion_wxyz(np.array(columns["quaternion_wxyz"], float).reshape(-1, 4))
        poses = [transform(r, t) for r, t in zip(rotations, columns["position_m"], strict=True)]
        return Grasps(
            gripper_to_object=np.array(poses).reshape(-1, 4, 4),
            width_m=np.array(columns["width_m"], float),
            depth_m=np.array(columns["depth_m"], float),
            score=np.array(columns["score"], float),
            verified=np.array(columns["verified"], bool),
            outcome=np.array(columns["outcome"], str),
            columns=columns,
        )

    def add_to_sapien(self, scene: Any, pose: Any = None, *, visual: bool = True) -> Any:
        """Add the twin to a SAPIEN 3 scene as a dynamic rigid body and return its entity.

        ``pose`` is a sapien.Pose of the object frame in the world. Mass, centre of mass, inertia and friction are the
        twin's own. With ``visual`` the textured mesh is added too, which needs a render system in the scene.
        """
        from manitwin.physics.sapien.body import add_body

        return add_body(
            scene,
            self.rigid_body(),
            restitution=self.physical.restitution.value,
            pose=pose,
            visual_glb=self.folder / "visual.glb" if visual else None,
            name=self.record.twin_id,
        )


class TwinSource:
    """Find twins by id below a data set's root.

    Those of a data set at a URL are copied to ``cache`` when they are asked for. Raises UsageError where there is no such
    place, or for a URL without ``cache``.
    """

    def __init__(self, place: str | Path, cache: Path | None = None):
        self.root = DatasetRoot(place)
        self.cache = cache
        if self.root.local is None and cache is None:
            raise UsageError(
                f"{place}: a data set at a URL needs a local folder to copy its twins to; name one as cache"
            )
        if self.root.local is not None and not self.root.local.is_dir():
            raise UsageError(
                f"{place}: no such folder; give a data set, or the folder that `manitwin build` made (for the twins of"
                " scenes or episodes: --twins)"
            )

    def twin_ids(self) -> list[str]:
        """Return the ids of all finished twins, accepted and rejected, sorted."""
        return list(self.root.twin_ids())

    def record_bytes(self, twin_id: str) -> bytes:
        """Return the content of a twin's twin.json; raises UsageError where there is no such twin."""
        try:
            return self.root.read_bytes(f"{self.root.twin_name(twin_id)}/{RECORD}")
        except FileNotFoundError as error:
            raise UsageError(self._missing(twin_id)) from error

    def check(self, twin_ids: Collection[str]) -> None:
        """Raise UsageError where twins are not there, with how many of them; only whether they are there is looked at."""
        gone = sorted(each for each in twin_ids if not self.root.exists(f"{self.root.twin_name(each)}/{RECORD}"))
        if gone:
            raise UsageError(self._missing(gone[0], f" ({len(gone):,} of {len(twin_ids):,} are missing)"))

    def folder(self, twin_id: str) -> Path:
        """Return a local folder with a twin's files; raises UsageError where there is no such twin."""
        name = self.root.twin_name(twin_id)
        if self.cache is None:
            folder = Path(self.root.full(name))
        else:
            folder = self.cache / twin_id
            if not (folder / RECORD).is_file():
                self.root.fetch_folder(name, folder)
        if not (folder / RECORD).is_file():
            raise UsageError(self._missing(twin_id))
        return folder

    def twin(self, twin_id: str) -> Twin:
        """Return the twin; raises UsageError where there is none of this id, TwinError where it cannot be read."""
        return Twin(self.folder(twin_id))

    def _missing(self, twin_id: str, count: str = "") -> str:
        return (
            f"{self.root.url}: no twin {twin_id} there{count}; put it back, or name the data set where the twins are now"
            " (--twins)"
        )
