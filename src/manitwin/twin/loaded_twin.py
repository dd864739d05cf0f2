"""A finished twin in memory: record, meshes, grasps as arrays, and insertion into a SAPIEN scene."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import trimesh

from manitwin.errors import TwinError, UsageError, unknown_name_message
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.npy_file import MAX_LABEL_BYTES, parse_labels
from manitwin.geometry.articulation import ArticulatedBody
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.twin.dataset_root import MAX_FILE_BYTES, DatasetRoot
from manitwin.twin.fill_records import FillState
from manitwin.twin.grasp_table import read_grasp_table
from manitwin.twin.loaded_links import articulated_body, joints_of, posed_parts, read_face_links
from manitwin.twin.mesh_files import read_hulls, read_visual
from manitwin.twin.part_records import FACE_PARTS, NO_PART
from manitwin.twin.record import Physical, TwinRecord
from manitwin.twin.store import RECORD, REMEDY, read_record


@dataclass(frozen=True)
class Grasps:
    """Grasps of one gripper; poses are ``gripper_to_object (N, 4, 4)`` in the grasp frame (+Z approach, X closing).

    ``verified (N,) bool``, ``width_m (N,)``, ``depth_m (N,)``, ``score (N,)``, ``outcome (N,) str``; further table columns by
    name in ``columns``.
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
    """A twin folder whose files are read on demand. Geometry is in the object frame: metres, +Z up, standing on z = 0."""

    def __init__(self, folder: str | Path, verify: bool = False):
        """Read the record; with ``verify``, check the digest of every file. Raises TwinError."""
        self.folder = Path(folder)
        self.record: TwinRecord = read_record(self.folder, verify=verify)

    def __repr__(self) -> str:
        return f"Twin({self.record.twin_id}, {self.record.name!r}, {self.record.status})"

    @property
    def physical(self) -> Physical:
        """The physical properties. Raises TwinError for a rejected twin."""
        if self.record.physical is None:
            reason = self.record.rejection.detail if self.record.rejection else "no physical properties"
            raise TwinError(f"{self.folder}: this twin was rejected ({reason}); only its record and source can be read")
        return self.record.physical

    @cached_property
    def visual(self) -> list[trimesh.Trimesh]:
        """The textured meshes in the object frame (Z-up)."""
        self.physical  # noqa: B018  a rejected twin has no meshes: say so
        return read_visual(self.folder / "visual.glb")

    @cached_property
    def hulls(self) -> list[trimesh.Trimesh]:
        """The convex collision hulls. Raises TwinError if a hull named in the record is missing."""
        self.physical  # noqa: B018
        return read_hulls(self.folder, self.record.files)

    def face_parts(self) -> np.ndarray:
        """Return the part of each face of the visual meshes, concatenated, as an index into ``record.parts``.

        Shape ``(F,) uint8``; 255 for faces that belong to no part, and for all faces of a twin without parts. Raises TwinError
        if the file has another number of faces or refers to parts that the record does not have.
        """
        faces = sum(len(mesh.faces) for mesh in self.visual)
        parts = len(self.record.parts)
        if not parts:
            return np.full(faces, NO_PART, np.uint8)
        path = self.folder / FACE_PARTS
        content = read_bytes(path, MAX_LABEL_BYTES, TwinError, inside=self.folder, name=str(path))
        labels = parse_labels(content, str(path), TwinError, remedy=REMEDY)
        if len(labels) != faces:
            raise TwinError(f"{path}: has parts for {len(labels)} faces, but visual.glb has {faces}; {REMEDY}")
        unknown = (labels != NO_PART) & (labels >= parts)
        if unknown.any():
            raise TwinError(
                f"{path}: refers to part {labels[unknown][0]}, but the record has {parts}, counted from 0; {REMEDY}"
            )
        return labels

    def face_links(self) -> np.ndarray:
        """Return the link of each face of the visual meshes, concatenated, as an index ``(F,)`` into ``record.links``.

        All are 0 for a twin that is one rigid body. Raises TwinError like ``face_parts``.
        """
        return read_face_links(self.folder, self.record, sum(len(mesh.faces) for mesh in self.visual))

    def posed_visual(self, positions: Mapping[str, float]) -> list[trimesh.Trimesh]:
        """Return the textured meshes with the named joints at ``positions`` (radians or metres), and other joints unchanged.

        Raises UsageError for an unknown joint or a position outside its limits.
        """
        return posed_parts(self.visual, self.face_links(), joints_of(self.record), positions)

    def articulated_body(self) -> ArticulatedBody:
        """Return the links with hulls, mass properties and friction, and their joints; a rigid twin is one link."""
        return articulated_body(self.record, self.rigid_body())

    def read_bytes(self, file: str) -> bytes:
        """Return the content of one of the twin's files. Raises TwinError if it is not a file in its folder."""
        return read_bytes(
            self.folder / file, MAX_FILE_BYTES, TwinError, inside=self.folder, name=f"{self.folder}/{file}"
        )

    def rigid_body(self, fill: float | None = None) -> RigidBody:
        """Return the collision hulls with the twin's mass properties and friction, for simulation.

        ``fill``: use the mass properties of a vessel filled to this share of its volume, from ``physical.filling``. Raises
        UsageError if the twin has no such state.
        """
        physical = self.physical
        weighed = physical if fill is None else self._filled(fill)
        return RigidBody(
            hulls=tuple(np.asarray(hull.vertices) for hull in self.hulls),
            mass_kg=weighed.mass_kg if isinstance(weighed, FillState) else weighed.mass_kg.value,
            center_of_mass_m=np.array(weighed.center_of_mass_m),
            inertia_kg_m2=np.array(weighed.inertia_kg_m2),
            friction_static=physical.friction_static.value,
            friction_dynamic=physical.friction_dynamic.value,
        )

    def _filled(self, share: float) -> FillState:
        filling = self.physical.filling
        if filling is None:
            raise UsageError(f"{self.folder}: has no fill states; only bottles, cans and jars have them")
        state = filling.state_at(share)
        if state is None:
            valid = [f"{each.share:g}" for each in filling.states]
            raise UsageError(f"{self.folder}: {unknown_name_message('fill', f'{share:g}', valid)}")
        return state

    def grasp_table(self) -> pa.Table:
        """Return all rows of ``grasps.parquet`` (docs/grasps.md). Raises TwinError if it cannot be read."""
        return read_grasp_table(self.folder / "grasps.parquet")

    def grasps(self, verified_only: bool = True, gripper: str | None = None, *, retired: bool = False) -> Grasps:
        """Return the grasps of a gripper (default: the first gripper, with which the twin was verified).

        The unfiltered sample, the jittered controls and retired grasps are left out. With ``retired``, retired grasps are
        included and marked in ``columns["retired"]``. Raises UsageError for a gripper that the twin was not tried with.
        """
        self.physical  # noqa: B018
        table = self.grasp_table().to_pydict()
        wanted = self._tried_gripper(gripper)
        rows = zip(table["gripper"], table["proposer"], table["verified"], table["retired"], strict=True)
        keep = [
            i
            for i, (name, proposer, held, gone) in enumerate(rows)
            if name == wanted
            and not proposer.endswith((":unfiltered", ":jittered"))
            and (held or not verified_only)
            and (retired or not gone)
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

    def _tried_gripper(self, name: str | None) -> str:
        """Return the gripper to read, by default the first; "" if the twin has no grasps. Raises UsageError for a gripper not
        tried.
        """
        summary = self.record.grasps
        tried = [] if summary is None else [summary.gripper, *sorted(summary.other_grippers)]
        if name is None:
            return tried[0] if tried else ""
        if not tried:
            raise UsageError(f"{self.folder}: has no grasps for any gripper; build it again with a gripper")
        if name not in tried:
            raise UsageError(f"{self.folder}: {unknown_name_message('gripper', name, tried)}")
        return name

    def add_to_sapien(self, scene: Any, pose: Any = None, *, visual: bool = True) -> Any:
        """Add the twin to a SAPIEN 3 scene as a dynamic rigid body and return its entity.

        ``pose`` is the pose of the object frame in the world, a sapien.Pose. Mass, centre of mass, inertia and friction are
        those of the twin. With ``visual`` the textured mesh is added as well, which requires a render system in the scene.
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


MOVED = "put it back, or give the data set where the twins are now (--twins)"
"""The remedy if scenes or episodes refer to a missing twin."""


class TwinSource:
    """Access to twins by id below a data set's root; ``remedy`` is appended to the message on a missing twin.

    Twins of a data set at a URL are copied to ``cache`` on demand. Raises UsageError if the place does not exist, or for a URL
    without ``cache``.
    """

    def __init__(self, place: str | Path, cache: Path | None = None, remedy: str = MOVED):
        self.root = DatasetRoot(place)
        self.cache, self._remedy = cache, remedy
        if self.root.local is None and cache is None:
            raise UsageError(
                f"{place}: a data set at a URL needs a local folder to copy its twins to; name one as cache"
            )
        if self.root.local is not None and not self.root.local.is_dir():
            raise UsageError(
                f"{place}: this folder does not exist; give a data set, or the folder that `manitwin build` made"
                f" (for the twins of"
                " scenes or episodes: --twins)"
            )

    def twin_ids(self) -> list[str]:
        """Return the ids of all finished twins, accepted and rejected, sorted."""
        return list(self.root.twin_ids())

    def record_bytes(self, twin_id: str) -> bytes:
        """Return the content of a twin's twin.json. Raises UsageError if there is no such twin."""
        try:
            return self.root.read_bytes(f"{self.root.twin_name(twin_id)}/{RECORD}")
        except FileNotFoundError as error:
            raise UsageError(self._missing(twin_id)) from error

    def check(self, twin_ids: Collection[str]) -> None:
        """Raise UsageError with the number of missing twins if any is missing; only the existence of their records is checked."""
        gone = sorted(each for each in twin_ids if not self.root.exists(f"{self.root.twin_name(each)}/{RECORD}"))
        if gone:
            raise UsageError(self._missing(gone[0], f" ({len(gone):,} of {len(twin_ids):,} are missing)"))

    def folder(self, twin_id: str) -> Path:
        """Return a local folder with a twin's files. Raises UsageError if there is no such twin."""
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
        """Return a twin. Raises UsageError if there is no such twin, TwinError if it cannot be read."""
        return Twin(self.folder(twin_id))

    def _missing(self, twin_id: str, count: str = "") -> str:
        return f"{self.root.url}: no twin {twin_id} there{count}; {self._remedy}"
