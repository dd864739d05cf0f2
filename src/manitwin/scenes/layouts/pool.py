"""Pool of twins for layouts: a light table of a data set's accepted twins, whose bodies are read on demand."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from pathlib import Path

import numpy as np
import trimesh
from pydantic import BaseModel, ValidationError

from manitwin.errors import TwinError, UsageError
from manitwin.formats.json_file import parse_json_object
from manitwin.geometry.cavity import Opening, find_opening
from manitwin.geometry.hull_distance import ConvexParts
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.scenes.layouts.twin_frames import LabelledPoint, TwinFrame, twin_frames
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.record import Placement
from manitwin.twin.record_digests import twin_state
from manitwin.twin.store import RECORD, REMEDY, migrate_content, parse_record

KEPT_BODIES = 256


@dataclass(frozen=True)
class StandingPose:
    """A settled placement: its index in the twin's record, and ``object_to_plane (4, 4)``.

    The origin of the plane frame is the centre of the circle of ``collision_radius_m`` around the projection.
    """

    placement: int
    object_to_plane: np.ndarray
    probability: float
    collision_radius_m: float
    upright: bool = False


@dataclass(frozen=True)
class PoolTwin:
    """The data of a twin that sampling needs; ``vessel``: it has an opening that its hulls leave open.

    ``frames`` are those of its functional points. ``jointed``: it has joints, although it is one rigid body in scenes.
    ``body_sha256`` is the digest of what determines its rest; ``grippers`` has digests of gripper files by name.
    """

    twin_id: str
    revision: str
    category: str
    poses: tuple[StandingPose, ...]
    vessel: bool
    frames: tuple[TwinFrame, ...] = ()
    jointed: bool = False
    body_sha256: str | None = None
    grippers: Mapping[str, str] = field(default_factory=dict)

    @property
    def has_upright_pose(self) -> bool:
        """True if one of its placements is upright."""
        return any(pose.upright for pose in self.poses)

    def is_a(self, category: str) -> bool:
        """Return whether the twin is of a category, or of a compound that ends with it (a frying pan is a pan)."""
        own, wanted = self.category.casefold(), " ".join(category.casefold().split())
        return own == wanted or own.endswith(f" {wanted}")


@dataclass(frozen=True)
class PoolBody:
    """The data of a twin that is read when it is drawn."""

    body: RigidBody
    parts: ConvexParts

    @cached_property
    def opening(self) -> Opening | None:
        """The largest opening of its hulls, in the object frame."""
        hulls = [trimesh.convex.convex_hull(hull) for hull in self.body.hulls]
        vertices, faces = trimesh.util.append_faces([h.vertices for h in hulls], [h.faces for h in hulls])
        return find_opening(trimesh.Trimesh(vertices, faces, process=False))


class Pool:
    """The twins that layouts may contain. ``read_body`` returns the body of a twin by its id; recently used ones are cached.

    Raises UsageError if there are none.
    """

    def __init__(
        self,
        twins: Iterable[PoolTwin],
        read_body: Callable[[str], RigidBody],
        bodies: dict[str, PoolBody] | None = None,
    ):
        self.twins = tuple(sorted(twins, key=lambda twin: twin.twin_id))
        self._read_body = read_body
        self._bodies: dict[str, PoolBody] = {} if bodies is None else bodies
        if not self.twins:
            raise UsageError("no accepted twin with a stable placement; build some first")

    def twin(self, twin_id: str) -> PoolTwin:
        """Return a twin by its id; raises UsageError if it does not exist."""
        if twin_id not in self._by_id:
            raise UsageError(f"no twin {twin_id!r} with a stable placement found; build it again, or give its data set")
        return self._by_id[twin_id]

    def find(self, twin_id: str) -> PoolTwin | None:
        """Return a twin by its id; None if it does not exist."""
        return self._by_id.get(twin_id)

    @cached_property
    def _by_id(self) -> dict[str, PoolTwin]:
        return {twin.twin_id: twin for twin in self.twins}

    def body(self, twin_id: str) -> PoolBody:
        """Return a twin's body and convex parts."""
        found = self._bodies.pop(twin_id, None)
        if found is None:
            body = self._read_body(twin_id)
            found = PoolBody(body, ConvexParts.of(body.hulls))
        self._bodies[twin_id] = found  # now the most recently used
        while len(self._bodies) > KEPT_BODIES:
            del self._bodies[next(iter(self._bodies))]
        return found

    @property
    def joints_remark(self) -> str | None:
        """A line on the twins with joints, which are locked in scenes and episodes; None if there are none."""
        jointed = sum(twin.jointed for twin in self.twins)
        return f"twins with joints, each one rigid body here as it stands: {jointed}" if jointed else None

    @cached_property
    def upright(self) -> Pool:
        """A pool of the same twins, limited to upright placements for those that have some; bodies are shared."""
        twins = (
            replace(twin, poses=tuple(pose for pose in twin.poses if pose.upright)) if twin.has_upright_pose else twin
            for twin in self.twins
        )
        return Pool(twins, self._read_body, self._bodies)

    def of_category(self, category: str) -> tuple[PoolTwin, ...]:
        """Return the twins of a category. Raises UsageError naming the available categories if there are none."""
        found = tuple(twin for twin in self.twins if twin.is_a(category))
        if not found:
            known = sorted({twin.category for twin in self.twins})
            some = ", ".join(known[:40]) + (", ..." if len(known) > 40 else "")
            raise UsageError(f"no twin of category {category!r}; there are: {some}")
        return found


def read_pool(dataset: str | Path, cache: Path | None = None) -> Pool:
    """Read the records of the accepted twins with a settled placement, in a data set or flat folder.

    ``cache`` is a local folder for the twins of a data set at a URL. Raises UsageError if there are none, TwinError for an
    invalid record or one of another schema version. An altered record is refused when its body is drawn (TwinError).
    """
    source = TwinSource(dataset, cache)
    read = (_pool_twin(source.record_bytes(twin_id), f"{dataset}: {twin_id}/{RECORD}") for twin_id in source.twin_ids())
    twins = [twin for twin in read if twin is not None]
    if not twins:
        raise UsageError(f"{dataset}: no accepted twin with a stable placement; give the folder of a build")

    def body(twin_id: str) -> RigidBody:
        twin = source.twin(twin_id)
        # only for drawn twins: hashing the records of a hundred thousand would take minutes
        parse_record(twin.read_bytes(RECORD), twin.folder / RECORD, sealed=True)
        return twin.rigid_body()

    return Pool(twins, body)


@lru_cache(maxsize=4)
def cached_pool(dataset: str, cache: str | None = None) -> Pool:
    """Return ``read_pool`` of a path, cached in the process: data sets are not expected to change while layouts are made."""
    return read_pool(dataset, None if cache is None else Path(cache))


class _Hulls(BaseModel):
    keeps_opening: bool | None = None


class _Mesh(BaseModel):
    hulls: _Hulls


class _Language(BaseModel):
    category: str


class _Points(BaseModel):
    functional: list[LabelledPoint] = []


class _RecordExcerpt(BaseModel):
    """The part of an accepted record that the pool needs: validating all of a hundred thousand records would take minutes."""

    twin_id: str
    revision: str
    placements: list[Placement]
    mesh: _Mesh
    language: _Language
    points: _Points = _Points()
    joints: list[object] = []


def _pool_twin(content: bytes, name: str) -> PoolTwin | None:
    data = migrate_content(parse_json_object(content, name, TwinError, remedy=REMEDY), name)
    if data.get("status") == "rejected":
        return None
    try:
        record = _RecordExcerpt.model_validate(data)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"]))[:80]
        raise TwinError(f"{name}: not a record of a twin ({where}: {first['msg']}); {REMEDY}") from error
    poses = tuple(
        StandingPose(
            number,
            transform(rotation_from_quaternion_wxyz(np.array(each.quaternion_wxyz)), np.array(each.position_m)),
            each.probability,
            each.collision_radius_m,
            each.upright,
        )
        for number, each in enumerate(record.placements)
        if each.settled
    )
    if not poses:
        return None
    state = twin_state(data, name)
    return PoolTwin(
        record.twin_id,
        state.revision,
        record.language.category,
        poses,
        record.mesh.hulls.keeps_opening is True,
        twin_frames(record.points.functional),
        jointed=bool(record.joints),
        body_sha256=state.body_sha256,
        grippers=state.grippers,
    )
