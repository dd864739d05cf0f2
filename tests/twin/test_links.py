"""A twin with links and joints is read, posed and refused as its record says."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from articulated_twins import CENTERS_M, JOINTS, MASSES_KG, NAMES, TILTED, links, write_articulated
from exported_twins import write_twin
from manitwin.errors import TwinError, UsageError
from manitwin.formats.npy_file import labels_to_npy
from manitwin.geometry.poses import transform_points
from manitwin.twin.link_records import FACE_LINKS, Joint
from manitwin.twin.loaded_twin import Twin


@pytest.fixture(scope="module")
def twin(tmp_path_factory: pytest.TempPathFactory) -> Twin:
    return Twin(write_articulated(tmp_path_factory.mktemp("twin") / "twin"), verify=True)


def test_links_are_bodies_with_their_own_hulls(twin: Twin) -> None:
    body = twin.articulated_body()
    assert [link.mass_kg for link in body.links] == list(MASSES_KG)
    assert [len(link.hulls) for link in body.links] == [1, 1, 1]
    assert np.allclose(body.links[1].hulls[0], twin.hulls[1].vertices)
    assert [(joint.parent, joint.child) for joint in body.joints] == [(0, 1), (1, 2)]


def test_a_rigid_twin_is_one_link(tmp_path: Path) -> None:
    rigid = Twin(write_twin(tmp_path / "twin"))
    assert len(rigid.articulated_body().links) == 1 and not rigid.record.joints
    assert not rigid.face_links().any()
    with pytest.raises(UsageError, match="no joints"):
        rigid.posed_visual({"hinge": 1.0})


def test_posed_parts_go_with_their_link(twin: Twin) -> None:
    head, handle, knob = twin.visual
    posed = twin.posed_visual({"slide": 0.05})
    assert np.allclose(posed[0].vertices, head.vertices) and np.allclose(posed[1].vertices, handle.vertices)
    assert np.allclose(posed[2].vertices, knob.vertices + 0.03 * np.array(JOINTS[1]["axis"]), atol=1e-6)
    bent = twin.posed_visual({"elbow": 0.35 + 0.5})
    origin, axis = np.array(JOINTS[0]["origin_m"]), np.array(TILTED)
    for before, after in (
        (handle, bent[1]),
        (knob, bent[2]),
    ):  # what turns keeps its distance from, and place along, the axis
        arms = [part.vertices - origin for part in (before, after)]
        assert np.allclose(arms[0] @ axis, arms[1] @ axis, atol=1e-6)
        assert np.allclose(np.linalg.norm(arms[0], axis=1), np.linalg.norm(arms[1], axis=1), atol=1e-6)
        across = [arm - np.outer(arm @ axis, axis) for arm in arms]
        turned = np.einsum("ij,ij->i", *across) / np.linalg.norm(across[0], axis=1) ** 2
        assert np.allclose(turned, np.cos(0.5), atol=1e-5)
        right_handed = np.einsum("ij,ij->i", np.cross(*across), np.tile(axis, (len(across[0]), 1)))
        assert (right_handed > 0).all()


def test_positions_beyond_the_limits_and_unknown_joints_are_refused(twin: Twin) -> None:
    with pytest.raises(UsageError, match=r"joint slide: 0\.5 m is outside of its limits, -0\.01 to 0\.06 m"):
        twin.posed_visual({"slide": 0.5})
    with pytest.raises(UsageError, match=r"unknown joint 'hinge'\. Valid: elbow, slide"):
        twin.posed_visual({"hinge": 0.5})


BROKEN: dict[str, tuple[dict[str, Any], str]] = {
    "one link": ({"links": links([1, 1, 1])[:1], "joints": []}, "two or more"),
    "no joint": ({"joints": [JOINTS[0]]}, "3 links are held by 2 joints, not by 1"),
    "in a circle": ({"joints": [JOINTS[0] | {"parent": "knob"}, JOINTS[1]]}, "after its parent"),
    "unknown link": ({"joints": [JOINTS[0], JOINTS[1] | {"parent": "wrist"}]}, "after its parent"),
    "two of a name": ({"joints": [JOINTS[0], JOINTS[1] | {"name": "elbow"}]}, "names of their own"),
    "long axis": ({"joints": [JOINTS[0] | {"axis": [1.0, 1.0, 0.0]}, JOINTS[1]]}, "not of length one"),
    "stands outside": ({"joints": [JOINTS[0] | {"locked_at": 3.0}, JOINTS[1]]}, "outside of its limits"),
    "one limit": ({"joints": [JOINTS[0] | {"lower": None}, JOINTS[1]]}, "two limits or none"),
    "endless revolute": ({"joints": [JOINTS[0] | {"lower": None, "upper": None}, JOINTS[1]]}, "a continuous one none"),
}


@pytest.mark.parametrize("case", BROKEN)
def test_a_record_that_no_mechanism_has_is_refused(tmp_path: Path, case: str) -> None:
    changes, why = BROKEN[case]
    with pytest.raises(ValidationError, match=why):
        write_articulated(tmp_path / "twin", **changes)


def test_faces_of_unknown_links_are_refused(tmp_path: Path) -> None:
    folder = write_articulated(tmp_path / "twin")
    faces = sum(link.faces for link in Twin(folder).record.links)
    (folder / FACE_LINKS).write_bytes(labels_to_npy(np.full(faces, 7, np.uint8)))
    with pytest.raises(TwinError, match="refers to link 7, but the record has 3"):
        Twin(folder).face_links()
    (folder / FACE_LINKS).write_bytes(labels_to_npy(np.zeros(3, np.uint8)))
    with pytest.raises(TwinError, match="has links for 3 faces"):
        Twin(folder).face_links()


def test_a_joint_record_round_trips(twin: Twin) -> None:
    for joint, moving in zip(twin.record.joints, twin.articulated_body().joints, strict=True):
        assert Joint.of(moving, NAMES) == joint
        center = transform_points(moving.motion(joint.locked_at), np.array([CENTERS_M[1]]))
        assert np.allclose(center, CENTERS_M[1]), "at locked_at nothing has moved"


def test_twins_of_earlier_versions_have_no_links(tmp_path: Path) -> None:
    folder = write_twin(tmp_path / "twin")
    record = json.loads((folder / "twin.json").read_text())
    for name in ("links", "joints"):
        del record[name]
    (folder / "twin.json").write_text(json.dumps(record | {"schema_version": 3}))
    assert Twin(folder).record.links == [] and Twin(folder).record.joints == []
