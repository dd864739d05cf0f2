from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from foreign_assets import given_record
from handmade import candidates, mug, subject
from manitwin.models.annotators.imported_annotations import ImportedAnnotator
from manitwin.models.annotators.protocol import PointsRequest, Subject
from manitwin.models.annotators.rules import RulesAnnotator

MUG = mug()


def given_subject(**given: Any) -> Subject:
    return replace(subject(MUG, "mug"), given=given_record(**given))


def request(of: Subject) -> PointsRequest:
    positions, normals = candidates(MUG)
    return PointsRequest(of, positions, normals, (), ((),) * 8, np.array([0, 0, 0.05]), 0.08)


def test_without_an_import_every_answer_is_the_inner_annotators() -> None:
    inner, keeps = RulesAnnotator(), ImportedAnnotator(RulesAnnotator())
    plain = subject(MUG, "mug")
    assert keeps.estimate_physical(plain) == inner.estimate_physical(plain)
    assert keeps.select_points(request(plain)) == inner.select_points(request(plain))
    assert (keeps.name, keeps.model_for("points"), keeps.expected_usd("points")) == ("rules", None, 0.0)


def test_given_numbers_are_kept_with_their_source_and_the_rest_is_asked() -> None:
    answer = ImportedAnnotator(RulesAnnotator()).estimate_physical(
        given_subject(mass_kg=0.31, friction_static=0.5, material="tin")
    )
    assert answer.mass_kg is not None
    assert (answer.mass_kg.value, answer.mass_kg.low, answer.mass_kg.source) == (0.31, 0.31, "imported:robotwin")
    assert answer.friction_static.source == "imported:robotwin" and answer.material == "tin"
    assert answer.restitution.source.startswith("prior:")
    assert answer.friction_dynamic.value <= answer.friction_static.value


def test_frictions_of_several_surfaces_are_the_interval_of_the_given_one() -> None:
    given = given_subject(friction_static=0.3, friction_dynamic=0.3, friction_range=(0.3, 1.4))
    answer = ImportedAnnotator(RulesAnnotator()).estimate_physical(given)
    for found in (answer.friction_static, answer.friction_dynamic):
        assert (found.value, found.low, found.high, found.source) == (0.3, 0.3, 1.4, "imported:robotwin")
    answer = ImportedAnnotator(RulesAnnotator()).estimate_physical(
        replace(given, given=given_record(friction_static=0.3))
    )
    assert (answer.friction_static.low, answer.friction_static.high) == (0.3, 0.3)


def test_given_mass_that_contradicts_the_prior_is_a_finding() -> None:
    answer = ImportedAnnotator(RulesAnnotator()).estimate_physical(given_subject(mass_kg=0.016))
    assert answer.findings is not None and any("mass 0.016 kg (imported:robotwin)" in text for text in answer.findings)


def test_dynamic_friction_never_exceeds_the_given_static_one() -> None:
    answer = ImportedAnnotator(RulesAnnotator()).estimate_physical(given_subject(friction_static=0.05))
    assert answer.friction_dynamic.value == 0.05
    answer = ImportedAnnotator(RulesAnnotator()).estimate_physical(given_subject(friction_dynamic=2.0))
    assert answer.friction_static.value == 2.0


def test_given_captions_come_first() -> None:
    said = given_subject(captions=["a mug of Anna's", "her cup"], category="coffee mug")
    language = ImportedAnnotator(RulesAnnotator()).describe(said, "ceramic", np.ptp(MUG.vertices, axis=0))
    assert (language.caption, language.captions[0], language.category) == ("a mug of Anna's", "her cup", "coffee mug")
    assert language.shape


def test_sentences_call_a_thing_what_its_category_says() -> None:
    called = replace(subject(MUG, "measuring cup"), given=given_record(category="measuring jug"))
    language = ImportedAnnotator(RulesAnnotator()).describe(called, "glass", np.ptp(MUG.vertices, axis=0))
    told = [caption for caption in (language.caption, *language.captions) if "measuring" in caption.split(" for ")[0]]
    assert language.category == "measuring jug"
    assert told and all("measuring jug" in caption and "measuring cup" not in caption for caption in told)


def test_given_points_snap_to_the_nearest_candidate() -> None:
    positions, _ = candidates(MUG)
    near = positions[7] + [0.003, 0, 0]
    functional = [{"position_m": near.tolist(), "normal": [0, 0, 1], "label": "rim"}]
    selected = ImportedAnnotator(RulesAnnotator()).select_points(request(given_subject(functional_points=functional)))
    first = selected.functional[0]
    assert first.candidate == int(np.linalg.norm(positions - near, axis=1).argmin())
    assert first.label == "rim" and first.rationale.startswith("imported:robotwin: annotated 3 mm")
    assert 2 <= len(selected.functional) <= 4 and 2 <= len(selected.grasp) <= 3  # filled up by the rules
    assert len({point.candidate for point in selected.functional}) == len(selected.functional)


def test_a_base_is_below_a_thin_floor_and_not_on_it() -> None:
    positions, normals = candidates(MUG)
    number = int(np.argmax(normals[:, 2] < -0.9))  # below
    inside = positions[number] + [0.004, 0, 0.003]
    asked = request(given_subject(functional_points=[_base_at(positions[number] + [0.02, 0, 0])]))
    thin = replace(
        asked, positions_m=np.concatenate([positions, inside[None]]), normals=np.concatenate([normals, [[0, 0, 1.0]]])
    )
    first = ImportedAnnotator(RulesAnnotator()).select_points(thin).functional[0]
    assert first.label == "base" and first.normal[2] < -0.9
    above = replace(thin, normals=np.tile([0, 0, 1.0], (len(thin.normals), 1)))
    selected = ImportedAnnotator(RulesAnnotator()).select_points(above)
    assert "base" not in [point.label for point in selected.functional if point.rationale.startswith("imported")]
    assert selected.findings is not None and "functional point 0" in selected.findings[0]


def _base_at(place_m: np.ndarray) -> dict[str, Any]:
    frame = {
        "position_m": place_m.tolist(), "quaternion_wxyz": [0.0, 1.0, 0.0, 0.0], "kind": "face", "size_m": 0.03,
        "free": "roll", "source": "template:mug",
    }  # fmt: skip
    return {"position_m": place_m.tolist(), "normal": [0, 0, -1], "label": "base", "frame": frame}


def test_points_are_filled_up_with_others_than_those_that_are_given() -> None:
    positions, _ = candidates(MUG)
    own = RulesAnnotator().select_points(request(subject(MUG, "mug"))).functional[0]
    rim = np.flatnonzero(positions[:, 2] > 0.95 * positions[:, 2].max())
    other = positions[next(i for i in rim if i != own.candidate)]
    functional = [{"position_m": other.tolist(), "normal": [0, 0, 1], "label": own.label}]
    selected = ImportedAnnotator(RulesAnnotator()).select_points(request(given_subject(functional_points=functional)))
    labels = [point.label for point in selected.functional]
    assert labels[0] == own.label and len(set(labels)) == len(labels) == 2, "the second tells another function"


def test_point_far_from_the_object_is_a_finding() -> None:
    far = [{"position_m": [1.0, 0, 0]}]
    selected = ImportedAnnotator(RulesAnnotator()).select_points(request(given_subject(functional_points=far)))
    assert (
        selected.findings is not None
        and "functional point 0 (imported:robotwin) has no candidate" in selected.findings[0]
    )
    assert not any(point.rationale.startswith("imported") for point in selected.functional)


def test_contact_between_the_fingers_is_on_the_surface_along_the_closing_axis() -> None:
    # the fingertips' centre of a grasp over the body lies on the axis of the mug, 40 mm from any surface
    inside = {"position_m": [0, 0, 0.08], "approach": [0, 0, -1], "closing": [0, 1, 0]}
    keeps = ImportedAnnotator(RulesAnnotator())
    kept = keeps.select_points(request(given_subject(grasp_points=[inside])))
    assert kept.grasp[0].rationale.startswith("imported:robotwin")
    bare = keeps.select_points(request(given_subject(grasp_points=[{"position_m": [0, 0, 0.08]}])))
    assert bare.findings is not None and "grasp point 0" in bare.findings[0]


def test_nobody_is_asked_where_enough_is_given() -> None:
    class Silent(RulesAnnotator):
        def select_points(self, request: PointsRequest) -> Any:
            pytest.fail("asked for points that are given")

    positions, _ = candidates(MUG)
    points = [{"position_m": positions[i].tolist()} for i in (1, 9, 20, 30, 35)]
    selected = ImportedAnnotator(Silent()).select_points(
        request(given_subject(functional_points=points, grasp_points=points[:2]))
    )
    assert [p.candidate for p in selected.functional] == [1, 9, 20, 30]
    assert selected.findings is not None and "beyond the first 4 of 5" in selected.findings[0]
