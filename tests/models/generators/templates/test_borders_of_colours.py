"""Parts in a colour of their own end at edges of the mesh."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from told_templates import TEMPLATES, made_of

from manitwin.models.generators.templates.ground_truth import mass_properties
from manitwin.models.generators.templates.template_object import TemplateObject

GROUPS = sorted({each.group for each in TEMPLATES.values()})


def _border(made: TemplateObject, one: str, other: str) -> np.ndarray:
    mesh = made.mesh
    first, second = (np.unique(mesh.faces[mesh.faces_of(name)]) for name in (one, other))
    return mesh.vertices[np.intersect1d(first, second)]


@pytest.mark.parametrize(
    ("text", "inner"),
    [
        ("a plate, 27 cm, white with blue rim", "inside"),
        ("a white mug with a red rim", "inside"),
        ("a white mug with a red rim", "body"),
        ("a bowl with a gold rim", "inside"),
        ("a frying pan with a red rim", "inside"),
        ("a wine glass with a gold rim", "bowl"),
        ("a ball with a red stripe", "body"),
    ],
)
def test_a_rim_of_another_colour_ends_at_one_height(text: str, inner: str) -> None:
    made = made_of(text)
    name = "stripe" if "stripe" in text else "rim"
    heights = np.abs(_border(made, name, inner)[:, 2] - (made.mesh.vertices[:, 2].mean() if name == "stripe" else 0.0))
    assert len(heights) >= 48 and np.ptp(heights) < 0.0005


def test_a_rim_of_the_colour_of_the_whole_cuts_nothing() -> None:
    assert len(made_of("a white mug").mesh.faces) < len(made_of("a white mug with a red rim").mesh.faces)
    assert len(made_of("a white mug").mesh.faces) == len(made_of("a white mug with a red handle").mesh.faces)


def test_mass_and_inertia_are_those_of_the_thing_in_one_colour() -> None:
    plain, rimmed = (mass_properties(made_of(text).solids) for text in ("a white mug", "a white mug with a red rim"))
    assert rimmed[0] == pytest.approx(plain[0], rel=1e-12)
    assert rimmed[2] == pytest.approx(plain[2], rel=1e-12)


@pytest.mark.parametrize("group", [GROUPS[0], *(pytest.param(group, marks=pytest.mark.slow) for group in GROUPS[1:])])
def test_every_part_of_a_template_can_end_at_edges(group: str) -> None:
    with_regions = 0
    for category, template in TEMPLATES.items():
        if template.group != group:
            continue
        assembly = template.build(**template.typical_measures()).assembly
        if not assembly.regions():
            continue
        with_regions += 1
        plain = assembly.mesh()
        cut = assembly.mesh(assembly.regions())
        first, second = (trimesh.Trimesh(each.vertices, each.faces, process=False) for each in (plain, cut))
        assert second.is_watertight and second.is_winding_consistent, category
        assert second.volume == pytest.approx(first.volume, rel=1e-9), category
        left = {cut.names[at] for at in np.unique(cut.part)}
        assert left >= {plain.names[at] for at in np.unique(plain.part)}, category
    assert with_regions, "the group has parts that end at edges"
