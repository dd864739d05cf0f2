"""The record import.json: what an imported asset states, converted to the object frame of twins, and what it lacks."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, ValidationError

from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.formats.printable import printable_line
from manitwin.geometry.poses import quaternion_wxyz, rotation_from_quaternion_wxyz
from manitwin.twin.link_records import Articulation
from manitwin.twin.point_records import FunctionalFrame
from manitwin.twin.record_values import Finite, Matrix3, Matrix4, Record, Vector3

IMPORT_RECORD, IMPORTED_MESH = "import.json", "asset.glb"
MAX_BYTES = 64 << 20
TEMPLATE = "template"
"""The format of a record with the known properties of an object built from a template."""
FITTED = "fitted"
"""The format of a record for a template that was fitted to a photo."""
MISSING_FILE = "file "
"""Prefix of entries in ``missing`` that name a file which the asset references but lacks."""
FILLED = "filled"
"""The format of a record for a template with given measures; ``attribution`` says who gave them."""
Positive = Annotated[Finite, Field(gt=0)]


class GivenPoint(Record):
    """An annotated point: position, outward normal (None: not stated), and label.

    For a place to grasp, ``position_m`` is between the fingertips, and ``approach`` and ``closing`` are unit vectors. ``frame``
    is the functional frame if the asset's creator states it.
    """

    position_m: Vector3
    normal: Vector3 | None = None
    label: str = ""
    approach: Vector3 | None = None
    closing: Vector3 | None = None
    frame: FunctionalFrame | None = None


class GivenGrasps(Record):
    """Grasps of one gripper in the grasp frame of twins; ``held`` states for each whether its creator considers it successful."""

    gripper: str
    gripper_to_object: list[Matrix4]
    depth_m: list[Finite]
    width_m: list[Finite]
    held: list[bool]


class GivenParts(Record):
    """The part of each face of the mesh, in file order, as an index into ``names``."""

    names: list[str]
    of_face: list[int]


class ImportRecord(Record):
    """An imported asset in the object frame: Z up, origin at the bottom centre of its visual meshes, metres.

    ``asset_to_object`` transforms the asset's own axes to this frame. ``missing`` lists in words what the asset does not state,
    ``dropped`` what it states but could not be imported, and why. ``articulation`` holds links and joints; all other values
    describe the whole asset in its current joint state. ``friction_range`` is the lowest and highest static friction of its
    surfaces, if they differ.
    """

    import_version: Literal[1] = 1
    format: str = Field(pattern=r"^[a-z0-9]+$")
    file: str
    name: str = Field(min_length=1)
    category: str | None
    license: str | None
    attribution: str | None
    asset_to_object: Matrix4
    mass_kg: Positive | None
    center_of_mass_m: Vector3 | None
    inertia_kg_m2: Matrix3 | None
    friction_static: Positive | None
    friction_dynamic: Positive | None
    restitution: Annotated[Finite, Field(ge=0, le=1)] | None
    material: str | None
    captions: list[str]
    functional_points: list[GivenPoint]
    grasp_points: list[GivenPoint]
    grasps: list[GivenGrasps]
    rests: list[Matrix4]
    missing: list[str]
    remarks: list[str]
    dropped: list[str] = Field(default_factory=list)
    parts: GivenParts | None = None
    articulation: Articulation | None = None
    friction_range: tuple[Positive, Positive] | None = None

    @property
    def source(self) -> str:
        """The source to be stated in an Estimate."""
        if self.format == FITTED:
            return f"template:{self.name}, fitted to the photo"
        if self.format == FILLED:
            return f"template:{self.name}, filled in by {self.attribution}"
        return f"template:{self.name}" if self.format == TEMPLATE else f"imported:{self.format}"

    @property
    def has_part_masses(self) -> bool:
        """Whether mass, centre of mass and inertia come from parts built with a material each."""
        return self.format in (TEMPLATE, FILLED)

    @property
    def has_annotated_poses(self) -> bool:
        """Whether the asset has points, grasps or resting poses, so that its orientation is intentional."""
        return bool(self.functional_points or self.grasp_points or self.grasps or self.rests) or self.format == "twin"

    @property
    def missing_files(self) -> list[str]:
        """The files that the asset references but lacks, as named in it."""
        return [what.removeprefix(MISSING_FILE) for what in self.missing if what.startswith(MISSING_FILE)]

    @property
    def prior_key(self) -> str:
        """The object's category or name: the key to the priors."""
        return self.category or self.name

    def moved(self, transform: np.ndarray) -> ImportRecord:
        """Return the record under a rigid transform ``(4, 4)`` of the object frame."""
        rotation = transform[:3, :3]
        center = None if self.center_of_mass_m is None else rotation @ self.center_of_mass_m + transform[:3, 3]
        inertia = None if self.inertia_kg_m2 is None else rotation @ np.array(self.inertia_kg_m2) @ rotation.T
        return self.model_copy(
            update={
                "asset_to_object": (transform @ np.array(self.asset_to_object)).tolist(),
                "center_of_mass_m": None if center is None else center.tolist(),
                "inertia_kg_m2": None if inertia is None else inertia.tolist(),
                "functional_points": [_transform_point(point, transform) for point in self.functional_points],
                "grasp_points": [_transform_point(point, transform) for point in self.grasp_points],
                "grasps": [
                    grasps.model_copy(
                        update={
                            "gripper_to_object": [(transform @ np.array(g)).tolist() for g in grasps.gripper_to_object]
                        }
                    )
                    for grasps in self.grasps
                ],
                "rests": [(np.array(rest) @ np.linalg.inv(transform)).tolist() for rest in self.rests],
                "articulation": None if self.articulation is None else self.articulation.moved(transform),
            }
        )

    def scaled(self, factor: float) -> ImportRecord:
        """Return the record with its points scaled by ``factor``; masses and grasps are unchanged, as they hold at true size
        only.
        """
        return self.model_copy(
            update={
                name: [
                    point.model_copy(
                        update={
                            "position_m": (factor * np.array(point.position_m)).tolist(),
                            "frame": None if point.frame is None else point.frame.scaled(factor),
                        }
                    )
                    for point in getattr(self, name)
                ]
                for name in ("functional_points", "grasp_points")
            }
        )

    def resized(self, factor: float) -> ImportRecord:
        """Return the record of an asset whose file has a wrong length unit: all lengths are multiplied by ``factor``, masses are
        kept.

        Grasps are dropped, because their finger widths do not scale.
        """
        center, inertia = self.center_of_mass_m, self.inertia_kg_m2
        grown = np.diag([factor, factor, factor, 1.0])
        return self.scaled(factor).model_copy(
            update={
                "center_of_mass_m": None if center is None else (factor * np.array(center)).tolist(),
                "inertia_kg_m2": None if inertia is None else (factor**2 * np.array(inertia)).tolist(),
                "grasps": [],
                "rests": [(grown @ np.array(rest) @ np.linalg.inv(grown)).tolist() for rest in self.rests],
                "articulation": None if self.articulation is None else self.articulation.scaled(factor),
            }
        )


def _transform_point(point: GivenPoint, transform: np.ndarray) -> GivenPoint:
    directions = {
        name: None if (value := getattr(point, name)) is None else (transform[:3, :3] @ value).tolist()
        for name in ("normal", "approach", "closing")
    }
    position = transform[:3, :3] @ point.position_m + transform[:3, 3]
    frame = None if point.frame is None else _transform_frame(point.frame, transform)
    return point.model_copy(update={"position_m": position.tolist(), "frame": frame, **directions})


def is_imported(folder: Path) -> bool:
    """Return whether a folder was written by ``manitwin import``."""
    return (folder / IMPORT_RECORD).is_file() and (folder / IMPORTED_MESH).is_file()


def read_import_record(path: Path) -> ImportRecord:
    """Read an import.json. Raises UsageError with the first validation error."""
    said = read_json_object(path, UsageError, limit_bytes=MAX_BYTES, inside=path.parent, name=str(path))
    try:
        return ImportRecord.model_validate(said)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        place = ".".join(str(part) for part in first["loc"])
        where = printable_line(place, max_characters=120)
        raise UsageError(f"{path}: {where}: {first['msg']}; import the asset again") from error


def _transform_frame(frame: FunctionalFrame, transform: np.ndarray) -> FunctionalFrame:
    """Return a frame under a rigid transform ``(4, 4)`` of the object frame."""
    rotation = transform[:3, :3] @ rotation_from_quaternion_wxyz(np.array(frame.quaternion_wxyz))
    position = transform[:3, :3] @ frame.position_m + transform[:3, 3]
    turned = quaternion_wxyz(rotation).tolist()
    return frame.model_copy(update={"position_m": position.tolist(), "quaternion_wxyz": turned})
