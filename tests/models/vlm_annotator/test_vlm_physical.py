"""Size, mass and friction as a model says them, against the mesh, the matter and the priors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import trimesh
from scripted_chat import ScriptedChat, annotator, changed, subject

from handmade import cup
from manitwin.errors import BadReply, Rejected
from manitwin.models.annotators.priors import load_materials
from manitwin.models.annotators.protocol import PhysicalEstimates
from manitwin.models.annotators.vlm.physical import Matter, PhysicalAnswer, part_materials, physical_question
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.models.annotators.vlm.question_parts import size_phrase


def interval(low: float, typical: float, high: float) -> dict[str, float]:
    return {"low": low, "typical": typical, "high": high}


# The cup of the mesh is 100 x 80 x 80 mm with walls of 3 mm: 81.8 cm3 of matter (closed form), 0.19 kg of ceramic.
GOOD: dict[str, Any] = {
    "shown": "A cup.",
    "object": "cup",
    "same_as_named": "yes",
    "materials": [{"part": "all", "material": "ceramic"}],
    "material": "glazed ceramic",
    "size_rationale": "fits a hand",
    "length_m": interval(0.09, 0.1, 0.11),
    "width_m": interval(0.07, 0.08, 0.09),
    "height_m": interval(0.07, 0.08, 0.09),
    "structure": "open_container",
    "wall_thickness_m": 0.003,
    "mass_rationale": "82 cm3 of ceramic",
    "mass_kg": interval(0.12, 0.19, 0.3),
    "friction_rationale": "glaze",
    "friction_static": interval(0.3, 0.4, 0.5),
    "friction_dynamic": interval(0.2, 0.3, 0.4),
    "restitution": interval(0.1, 0.3, 0.5),
}


def estimated(
    folder: Path,
    *answers: dict[str, Any],
    name: str | None = "cup",
    metric: bool = True,
    mesh: trimesh.Trimesh | None = None,
) -> tuple[ScriptedChat, PhysicalEstimates]:
    chat = ScriptedChat(*answers)
    of = subject(cup() if mesh is None else mesh, folder, name, metric=metric)
    return chat, annotator(chat).estimate_physical(of)


def test_plausible_answer_is_taken_as_it_is(tmp_path: Path) -> None:
    chat, estimates = estimated(tmp_path, GOOD, metric=False)
    assert len(chat.asked) == 1 and estimates.findings == ()
    assert estimates.longest_axis_m is not None and estimates.mass_kg is not None
    assert (estimates.longest_axis_m.low, estimates.longest_axis_m.value, estimates.longest_axis_m.high) == (
        0.09,
        0.1,
        0.11,
    )
    assert {estimates.longest_axis_m.source, estimates.mass_kg.source, estimates.friction_static.source} == {
        "vlm:eyes-1"
    }
    assert estimates.wall_thickness_m is None, "the mesh has both sides of the wall"


def test_metric_mesh_keeps_its_size(tmp_path: Path) -> None:
    _, estimates = estimated(tmp_path, GOOD)
    assert estimates.longest_axis_m is None


def test_longest_side_is_found_however_the_sides_are_named(tmp_path: Path) -> None:
    stood = changed(GOOD, length_m=GOOD["width_m"], height_m=GOOD["length_m"])
    chat, estimates = estimated(tmp_path, stood, metric=False)
    assert len(chat.asked) == 1 and estimates.longest_axis_m is not None and estimates.longest_axis_m.value == 0.1


MILD = [
    ("proportions", {"width_m": interval(0.03, 0.04, 0.05)}, "1 : 0.80 : 0.40"),
    ("mass of another matter", {"mass_kg": interval(0.01, 0.012, 0.02)}, "kg/m3"),
    ("mass above the prior", {"mass_kg": interval(0.3, 0.4, 0.5)}, "nearly every cup"),
    ("slippery as nothing dry", {"friction_static": interval(0, 0.02, 0.1), "friction_dynamic": interval(0, 0.01, 0.02)},
     "friction_static 0.02"),
    ("sticky as nothing dry", {"friction_static": interval(1, 1.8, 2)}, "friction_static 1.8"),
    ("dynamic above static", {"friction_dynamic": interval(0.3, 0.5, 0.6)}, "is above friction_static"),
    ("no wall", {"wall_thickness_m": 0}, "wall_thickness_m is 0"),
    ("wall as thick as the cup", {"wall_thickness_m": 0.06}, "does not fit twice"),
    ("another thing", {"same_as_named": "no", "object": "tin whistle"}, "'tin whistle'"),
]  # fmt: skip


@pytest.mark.parametrize(("changes", "said"), [m[1:] for m in MILD], ids=[m[0] for m in MILD])
def test_mild_contradiction_is_asked_again_and_marked(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    chat, estimates = estimated(tmp_path, changed(GOOD, **changes))
    assert len(chat.asked) == 2 and said in chat.complaint()
    assert estimates.findings is not None and any(said in finding for finding in estimates.findings)
    chat, estimates = estimated(tmp_path, changed(GOOD, **changes), GOOD)
    assert estimates.findings == () and estimates.mass_kg is not None and estimates.mass_kg.value == 0.19


def test_size_that_the_file_contradicts_is_marked(tmp_path: Path) -> None:
    half = {side: interval(*(0.5 * v for v in GOOD[side].values())) for side in ("length_m", "width_m", "height_m")}
    _, estimates = estimated(tmp_path, changed(GOOD, **half))
    assert estimates.findings is not None and "file declares 0.1 m" in estimates.findings[0]


IMPOSSIBLE = [
    ("no matter is as heavy", {"mass_kg": interval(2, 3, 4)}, "chalice thing", "implausible_mass"),
    ("no matter is as light", {"mass_kg": interval(1e-5, 1e-4, 1e-3)}, "chalice thing", "implausible_mass"),
    ("far above the prior", {"mass_kg": interval(0.7, 0.8, 0.9)}, "cup", "implausible_mass"),
    ("far above the prior of what is seen", {"mass_kg": interval(0.7, 0.8, 0.9)}, None, "implausible_mass"),
]


@pytest.mark.parametrize(("changes", "name", "reason"), [i[1:] for i in IMPOSSIBLE], ids=[i[0] for i in IMPOSSIBLE])
def test_impossible_answer_is_rejected_when_given_twice(
    tmp_path: Path, changes: dict[str, Any], name: str | None, reason: str
) -> None:
    given = changed(GOOD, **changes) | ({"object": "oddity"} if name == "chalice thing" else {})
    with pytest.raises(Rejected) as raised:
        estimated(tmp_path, given, name=name)
    assert raised.value.reason == reason
    chat, estimates = estimated(tmp_path, given, GOOD, name=name)
    assert len(chat.asked) == 2 and estimates.findings == ()


def test_absurd_size_is_rejected_where_it_would_be_used(tmp_path: Path) -> None:
    huge = {side: interval(*(10 * v for v in GOOD[side].values())) for side in ("length_m", "width_m", "height_m")}
    with pytest.raises(Rejected, match="longest side 1 m") as raised:
        estimated(tmp_path, changed(GOOD, mass_kg=interval(0.1, 0.3, 0.35), **huge), metric=False)
    assert raised.value.reason in ("implausible_size", "implausible_mass")


def test_closed_skin_gets_its_wall(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
    side = interval(0.07, 0.08, 0.09)
    shell = changed(
        GOOD, object="oddity", materials=[{"part": "all", "material": "plastic"}], structure="hollow_closed",
        wall_thickness_m=0.002, mass_kg=interval(0.03, 0.042, 0.06), length_m=side, width_m=side, height_m=side,
    )  # fmt: skip
    chat, estimates = estimated(tmp_path, shell, name=None, mesh=ball)
    assert len(chat.asked) == 1 and estimates.wall_thickness_m == 0.002
    # 20106 mm2 of skin, 2 mm thick, in plastic: 0.042 kg; as heavy as if it were full is said to be wrong.
    chat, estimates = estimated(tmp_path, changed(shell, mass_kg=interval(1.2, 1.4, 1.6)), name=None, mesh=ball)
    assert estimates.findings is not None and "hollow_closed" in estimates.findings[0]


@pytest.mark.parametrize(
    "changes",
    [{"mass_kg": interval(0.3, 0.2, 0.4)}, {"mass_kg": interval(0, 0.1, 0.2)}, {"materials": []}, {"structure": "thin"},
     {"restitution": interval(0.1, 0.3, 1.5)}],
)  # fmt: skip
def test_malformed_answer_is_repaired_once_and_never_used(tmp_path: Path, changes: dict[str, Any]) -> None:
    chat, estimates = estimated(tmp_path, changed(GOOD, **changes), GOOD)
    assert len(chat.asked) == 2 and estimates.findings == ()
    with pytest.raises(BadReply):
        estimated(tmp_path, changed(GOOD, **changes))


def test_proportions_are_not_told_nor_a_size_that_nobody_declared(tmp_path: Path) -> None:
    texts = []
    for mesh in (cup(), cup(radius_m=0.03, height_m=0.4)):
        question = physical_question(subject(mesh, tmp_path, "cup", metric=False), load_prompts(None)["physical"])
        texts.append([question.instructions, *(part for part in question.parts if isinstance(part, str))])
    assert texts[0] == texts[1] and any("The user calls it: cup. Nobody has said" in part for part in texts[0])


def test_declared_size_is_told_for_the_mass_belongs_to_it(tmp_path: Path) -> None:
    question = physical_question(subject(cup(), tmp_path, "cup"), load_prompts(None)["physical"])
    said = next(part for part in question.parts if isinstance(part, str))
    assert f"declares how large it is: {size_phrase(cup().extents)}" in said and "Nobody has said" not in said


def test_material_that_no_picture_tells_may_be_said_to_be_unknown(tmp_path: Path) -> None:
    answer = changed(GOOD, materials=[{"part": "all", "material": "unknown"}])
    assert estimated(tmp_path, answer)[1].mass_kg is not None


def test_materials_are_those_of_the_table() -> None:
    assert {*Matter.__args__} - {"other", "unknown"} == {*load_materials()} - {"unknown"}  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("name", "said", "told"),
    [
        ("fork", "head, neck and tang=steel; handle=plastic", {"head": "steel", "neck": "steel", "handle": "plastic"}),
        ("hammer", "head=steel; handle=wood; grip=rubber", {"head": "steel", "neck": "wood", "handle": "wood"}),
        ("frying pan", "body=aluminium; handle=plastic; bracket=steel", {"body": "aluminium", "handle": "plastic"}),
        ("hammer", "shaft=steel; head=unknown", None),  # a shaft may be head, neck or handle
        ("cup", "body=ceramic; handle=wood", {"body": "ceramic"}),  # no rule tells a cup's handle
        ("clamp", "jaws=steel; handles=plastic", {"tip": "steel", "end": "plastic"}),
        ("toy", "body=steel; handle=wood", None),  # a form whose parts no rule tells
    ],
)
def test_materials_go_to_the_parts_that_they_name(name: str, said: str, told: dict[str, str] | None) -> None:
    rows = [dict(zip(("part", "material"), row.split("="), strict=True)) for row in said.split("; ")]
    answer = PhysicalAnswer.model_validate({**GOOD, "object": name, "materials": rows})
    assert part_materials(answer, name) == told
