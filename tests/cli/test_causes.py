"""Causes: equal ones counted together, the most frequent told with a remedy."""

from __future__ import annotations

import ast
from itertools import chain
from pathlib import Path

import pytest

import manitwin
from manitwin.cli.causes import AS_SCENERY, MEASURE_IT, NAME_IT, REMEDIES, cause_lines, group_causes
from manitwin.engine.ledger.progress import Unaccepted
from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh
from manitwin.models.fakes.meshes import draco_glb
from manitwin.pipeline.guesses import OF_ANYTHING, SIZE_UNSAID
from manitwin.pipeline.size_remarks import TRULY_LARGE
from manitwin.twin.record import REJECTION_REASONS


def failed(which: int, message: str) -> Unaccepted:
    return Unaccepted(str(which), "failed", "error", f"episodes failed 3 times: {message}")


def missing(which: int, twin: str, root: str = "/data/set one") -> Unaccepted:
    return failed(which, f"UsageError: {root}: no twin {twin} there; put it back (twin_source.py:55)")


def test_causes_are_equal_but_for_ids_paths_names_and_numbers() -> None:
    causes = group_causes(
        [
            failed(1, "BadReply: model answered nothing; ask again"),
            missing(2, "5feceb66ffc86f38"),
            missing(3, "6b86b273ff34fce1"),
            failed(4, "KeyError: 'mass' (physical.py:12)"),
            missing(5, "d4735e3a265e16ee"),
            failed(6, "KeyError: 'mass' (physical.py:14)"),
        ]
    )
    assert [(cause.count, cause.example) for cause in causes] == [(3, "2"), (2, "4"), (1, "1")]
    assert causes[0].message == "/data/set one: no twin 5feceb66ffc86f38 there" and causes[0].remedy == "put it back"
    assert causes[1].message == "KeyError: 'mass'" and causes[1].remedy is None


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("/data/a/mug.obj: broken", "/other/cup.ply: broken"),
        ("s3://bucket/a: gone", "s3://bucket/b: gone"),
        ("lift cannot make a mesh from text ('a mug')", "lift cannot make a mesh from text ('a cup')"),
        ("took longer than 30 s", "took longer than 2.5 s"),
    ],
)
def test_what_varies_from_item_to_item_is_no_other_cause(one: str, other: str) -> None:
    assert len(group_causes([failed(1, one), failed(2, other)])) == 1
    assert len(group_causes([failed(1, one), failed(2, f"{other}, and more")])) == 2


@pytest.mark.parametrize(
    ("said", "message", "remedy"),
    [
        ("ValueError: bad header 'a; b' in row", "ValueError: bad header 'a; b' in row", None),
        ("ValueError: bad header a; b in row", "ValueError: bad header a; b in row", None),
        ("UsageError: no column 'a; b' there", "no column 'a; b' there", None),
        ("UsageError: the set's 'a; b' is gone; don't move it", "the set's 'a; b' is gone", "don't move it"),
        ("BadReply: x says: later; nothing; ask again", "x says: later; nothing", "ask again"),
        (f"UsageError: {'x' * 600}; leave it out", f"{'x' * 500} ...", "leave it out"),
        ("the worker process died (signal 11); stack: a; b", "the worker process died (signal 11); stack: a; b", None),
    ],
)
def test_only_a_message_of_our_own_errors_ends_with_its_remedy(said: str, message: str, remedy: str | None) -> None:
    (cause,) = group_causes([failed(1, said)])
    assert (cause.message, cause.remedy) == (message, remedy)


def test_a_rejection_without_a_known_remedy_has_none() -> None:
    assert "quiet" not in REMEDIES
    (cause,) = group_causes([Unaccepted("1", "rejected", "quiet", "quiet: nothing said; a rehearsal")])
    assert (cause.message, cause.remedy) == ("nothing said; a rehearsal", None)


@pytest.mark.parametrize(
    ("said", "remedy"),
    [
        ("a.png: the box 1,2,3,4 lies outside the photo, which is 2 x 2 pixels; give others", "give others"),
        (
            "b.png: a mask of 3 x 3 pixels, and its photo has 2 x 2; give it at the photo's size",
            "give it at the photo's size",
        ),
    ],
)
def test_where_a_thing_was_said_to_be_is_no_fault_of_the_photo(said: str, remedy: str) -> None:
    (cause,) = group_causes([Unaccepted("1", "rejected", "unreadable", f"unreadable: {said}")])
    assert cause.remedy == remedy and cause.message == said.removesuffix(f"; {remedy}")


def test_a_remedy_is_said_once() -> None:
    said = f"empty: a.png: the file has zero bytes; {REMEDIES['empty']}"
    (cause,) = group_causes([Unaccepted("1", "rejected", "empty", said)])
    assert (cause.message, cause.remedy) == ("a.png: the file has zero bytes", REMEDIES["empty"])


def test_rejections_are_grouped_by_their_reason_and_apart_from_failures() -> None:
    items = [
        Unaccepted("a.png", "rejected", "too_small", "too_small: a.png: 1 x 1 pixels"),
        Unaccepted("1", "failed", "timeout", "verify failed 3 times: no answer in 600 s"),
        Unaccepted("b.png", "rejected", "empty", "empty: b.png: the file has zero bytes"),
        Unaccepted("c.png", "rejected", "empty", "empty: c.png: the file has zero bytes"),
    ]
    lines = cause_lines(group_causes(items), again="manitwin retry DATA", others="manitwin status DATA")
    assert lines == [
        "why rejected: 2 of 3 empty, such as item b.png: b.png: the file has zero bytes",
        f"  remedy: {REMEDIES['empty']}",
        "  1 other cause: manitwin status DATA",
        "why failed: 1 of 1, item 1: no answer in 600 s",
        f"  remedy: {REMEDIES['timeout']}; then manitwin retry DATA",
    ]


def test_the_remedy_for_a_compressed_mesh_leads_to_no_compressed_one(tmp_path: Path) -> None:
    (tmp_path / "a.glb").write_bytes(draco_glb())
    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / "a.glb")
    (cause,) = group_causes([Unaccepted("1", "rejected", caught.value.reason, str(caught.value))])
    assert "KHR_draco_mesh_compression" in cause.message
    assert cause.remedy is not None and "a mesh as GLB" in cause.remedy


def test_nothing_is_said_where_all_were_accepted() -> None:
    assert cause_lines(group_causes([]), again="", others="") == []


def test_every_reason_for_a_rejection_has_a_remedy() -> None:
    assert set(chain(*REJECTION_REASONS.values())) <= set(REMEDIES)
    assert reasons_of_layouts() and reasons_of_layouts() <= set(REMEDIES)


def reasons_of_layouts() -> set[str]:
    """The words in the code of layouts that are given as a reason."""
    tree = ast.parse((Path(manitwin.__path__[0]) / "scenes/layouts/sample.py").read_text())
    given: list[ast.expr] = [
        node.args[0] for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "Rejected"
    ]
    given += [
        node.value
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "reason"
    ]
    branches = chain(*([n.body, n.orelse] if isinstance(n, ast.IfExp) else [n] for n in given))
    return {n.value for n in branches if isinstance(n, ast.Constant)}


def too_wide(which: int, of: str = "") -> Unaccepted:
    return Unaccepted(str(which), "rejected", "too_wide", f"narrowest grip is 150.0 mm, the gripper opens 80 mm{of}")


def test_a_size_that_nobody_has_said_asks_for_a_name_before_a_wider_gripper() -> None:
    nameless = too_wide(1, f", but {SIZE_UNSAID}: 15 cm is what is {OF_ANYTHING} (2 to 60 cm)")
    named = too_wide(2, f", but {SIZE_UNSAID}: 28 cm is what is usual of a frying pan (20 to 45 cm)")
    first, second, third = group_causes([nameless, named, too_wide(3)])
    assert (first.count, second.count, third.count) == (1, 1, 1), "their remedies differ"
    assert first.remedy == NAME_IT and "--name" in NAME_IT and "gripper" not in NAME_IT
    assert second.remedy == f"{MEASURE_IT}; else {REMEDIES['too_wide']}" and "--units" in MEASURE_IT
    assert third.remedy == REMEDIES["too_wide"]
    assert f"  remedy: {NAME_IT}" in cause_lines([first], again="", others="")


def test_what_truly_is_too_large_is_not_asked_for_its_unit() -> None:
    sofa = Unaccepted("1", "rejected", "absurd_size", f"the longest side is 2.4 m; a sofa {TRULY_LARGE}")
    mug = Unaccepted("2", "rejected", "absurd_size", "the longest side is 80 m; give the right units")
    first, second = group_causes([sofa, mug])
    assert first.remedy == AS_SCENERY and second.remedy == REMEDIES["absurd_size"]
