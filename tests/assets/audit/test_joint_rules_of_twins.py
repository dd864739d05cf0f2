"""A twin with joints is audited: links against files and mass, joints by their rules, and set down with its joints free."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from articulated_twins import JOINTS, links, write_articulated
from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.finding import Finding
from manitwin.assets.audit.rules import RULES
from manitwin.formats.npy_file import labels_to_npy
from manitwin.twin.link_records import FACE_LINKS
from manitwin.twin.loaded_twin import Twin

FACES = [12, 12, 80]


def findings(folder: Path, code: str, engines: tuple[str, ...] = ()) -> list[Finding]:
    return [each for each in audit_path(folder, RULES, engines=engines).findings if each.code == code]


def test_links_that_weigh_what_the_twin_does_are_no_finding(tmp_path: Path) -> None:
    folder = write_articulated(tmp_path / "twin")
    assert [link.faces for link in Twin(folder).record.links] == FACES
    assert not findings(folder, "TWN006")


CHANGES: dict[str, tuple[dict[str, Any], str]] = {
    "mass": (
        {"links": [links(FACES)[0] | {"mass_kg": 0.5}, *links(FACES)[1:]]},
        "weigh 0.67 kg together, the twin 0.37 kg",
    ),
    "hulls": ({"links": [links(FACES)[0] | {"hulls": [0, 1]}, *links(FACES)[1:]]}, "3 hulls are not each of one link"),
    "faces": ({"links": links([13, 11, 80])}, "have 12, 12, 80 faces, the record says 13, 11, 80"),
}


@pytest.mark.parametrize("case", CHANGES)
def test_links_that_contradict_the_twin_are_found(tmp_path: Path, case: str) -> None:
    changes, words = CHANGES[case]
    (found,) = findings(write_articulated(tmp_path / "twin", **changes), "TWN006")
    assert words in found.message


def test_labels_that_are_not_the_meshs_are_found(tmp_path: Path) -> None:
    folder = write_articulated(tmp_path / "twin")
    (folder / FACE_LINKS).write_bytes(labels_to_npy(np.zeros(5, np.uint8)))
    (found,) = findings(folder, "TWN006")
    assert "has links for 5 faces" in found.message


def test_the_rules_of_joints_hold_for_twins_too(tmp_path: Path) -> None:
    degrees = [JOINTS[0] | {"lower": -45.0, "upper": 90.0}, JOINTS[1]]
    (found,) = findings(write_articulated(tmp_path / "twin", joints=degrees), "JNT003")
    assert "looks like degrees" in found.message


def test_a_twin_whose_links_hold_is_set_down(tmp_path: Path) -> None:
    assert not findings(write_articulated(tmp_path / "twin"), "RUN011", ("mujoco",))


def test_a_twin_that_no_engine_takes_is_found(tmp_path: Path) -> None:
    needle = links(FACES)
    needle[2] |= {"inertia_kg_m2": [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1.0]]}  # no body has such moments
    (found,) = findings(write_articulated(tmp_path / "twin", links=needle), "RUN011", ("mujoco",))
    assert "mujoco does not run it with its joints free" in found.message


def test_a_joint_that_is_pushed_past_its_limit_is_found(tmp_path: Path) -> None:
    heavy = links(FACES)
    heavy[1] |= {"mass_kg": 4000.0, "center_of_mass_m": [-3.0, 0.0, 0.03]}
    (found,) = findings(write_articulated(tmp_path / "twin", links=heavy), "RUN011", ("mujoco",))
    assert "beyond its limit" in found.message or "plane" in found.message
