"""Points chosen by numbers: only visible ones, other numbers in each query, a vote by place."""

from __future__ import annotations

import io
import threading
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scripted_chat import ScriptedChat, annotator, points_request

from handmade import mug
from manitwin.errors import BadReply
from manitwin.models.annotators.protocol import PointsRequest
from manitwin.models.annotators.vlm.place_checks import PlaceChecks
from manitwin.models.annotators.vlm.points import (
    functional_numbering,
    grasp_numbering,
    grasp_numbers,
    grasp_question,
)
from manitwin.models.annotators.vlm.prompt_files import load_prompts
from manitwin.models.annotators.vlm.view_pictures import marked_views
from manitwin.models.annotators.vlm.vote_views import own_views
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.render.cameras import project
from manitwin.render.markers import DOT
from manitwin.twin.point_records import GraspPoint


@pytest.fixture(scope="module")
def request_of_mug(tmp_path_factory: pytest.TempPathFactory) -> PointsRequest:
    return points_request(mug(), tmp_path_factory.mktemp("views"), "mug")


@pytest.fixture
def without_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """For what does not depend on pictures: drawing those of a vote takes longer than all else."""
    monkeypatch.setattr("manitwin.models.annotators.vlm.points.marked_views", lambda *_: ([], "red"))
    monkeypatch.setattr("manitwin.models.annotators.vlm.points.views_of_vote", lambda request, *_: own_views(request))


def ids_of(question: Question) -> list[str]:
    return question.schema["properties"]["points"]["items"]["properties"]["id"]["enum"]


def functional(*choices: tuple[str, str]) -> dict[str, Any]:
    points = [
        {"rationale": "there", "label": label, "description": "use", "id": number, "confidence": 0.8}
        for label, number in choices
    ]
    return {"shown": "a mug", "points": points}


def grasps(*choices: tuple[str, str, str, float]) -> dict[str, Any]:
    points = [
        {"rationale": f"marker {number} is near", "label": label, "id": number, "type": kind, "scenario": "lift",
         "confidence": confidence}
        for label, number, kind, confidence in choices
    ]  # fmt: skip
    return {"shown": "a mug", "points": points}


def by_place(request: PointsRequest, *places: tuple[str, int, str, float]) -> Callable[[Question], dict[str, Any]]:
    """Answer a grasp question with candidates, by whatever number they have in it."""

    def answer(question: Question) -> dict[str, Any]:
        numbers = grasp_numbers(request, question.vote)
        return grasps(*((label, str(numbers[i]), kind, confidence) for label, i, kind, confidence in places))

    return answer


def nearest(request: PointsRequest, place: tuple[float, float, float], count: int = 1) -> list[int]:
    seen = {i for view in request.visible for i in view}
    order = np.argsort(np.linalg.norm(request.positions_m - place, axis=1))
    return [int(i) for i in order if int(i) in seen][:count]


def good_functional(request: PointsRequest) -> dict[str, Any]:
    numbers = functional_numbering(request).numbers
    top, base = nearest(request, (0, 0.0385, 0.1))[0], nearest(request, (0, 0, 0))[0]
    return functional(("rim", str(numbers[top])), ("base", str(numbers[base])))


@pytest.mark.usefixtures("without_pictures")
def test_same_places_win_whatever_their_numbers_are(request_of_mug: PointsRequest) -> None:
    request = request_of_mug
    handle, wall = nearest(request, (0.075, 0, 0.05))[0], nearest(request, (0, 0.04, 0.05))[0]
    answer = by_place(request, ("handle", handle, "parallel_jaw", 0.9), ("body", wall, "power", 0.6))
    chat = ScriptedChat(good_functional(request), answer)
    selected = annotator(chat).select_points(request)
    assert [(p.candidate, p.type, p.confidence) for p in selected.grasp] == [
        (handle, "parallel_jaw", 0.9),
        (wall, "power", 0.6),
    ]
    assert selected.findings == () and len(chat.asked) == 4
    chosen = [
        by_place(request, ("handle", handle, "parallel_jaw", 0.9))(q)["points"][0]["id"] for q, _ in chat.asked[1:]
    ]
    assert len(set(chosen)) > 1, "each query has other numbers"
    assert f"candidates {handle} is near" in selected.grasp[0].rationale
    assert selected.grasp[0].position_m == request.positions_m[handle].tolist()


@pytest.mark.usefixtures("without_pictures")
def test_model_that_says_the_lowest_numbers_gets_no_majority(request_of_mug: PointsRequest) -> None:
    def lowest(question: Question) -> dict[str, Any]:
        return grasps(*(("body", number, "power", 0.9) for number in ids_of(question)[:2]))

    selected = annotator(ScriptedChat(good_functional(request_of_mug), lowest)).select_points(request_of_mug)
    assert len(selected.grasp) == 2 and all(point.confidence < 0.7 for point in selected.grasp)
    assert selected.findings is not None and any("no majority" in finding for finding in selected.findings)


def test_enum_holds_only_what_some_view_shows(request_of_mug: PointsRequest) -> None:
    hidden = {3, 7}
    request = replace(
        request_of_mug, visible=tuple(tuple(i for i in v if i not in hidden) for v in request_of_mug.visible)
    )
    chat = ScriptedChat(
        good_functional(request), by_place(request, ("body", 1, "power", 0.9), ("body", 2, "power", 0.8))
    )
    annotator(chat).select_points(request)
    seen = {i for view in request.visible for i in view}
    for question, _ in chat.asked:
        of_grasps = question.name == "grasp_points"
        numbering = grasp_numbering(request, question.vote, 3) if of_grasps else functional_numbering(request)
        numbers = numbering.numbers
        if question.vote == 0:
            assert numbering.views.seen == seen
        assert set(ids_of(question)) == {str(numbers[i]) for i in numbering.views.seen}
        listed = next(part for part in reversed(question.parts) if isinstance(part, str))
        assert not any(f" {numbers[i]}: " in listed for i in hidden - numbering.views.seen)
    unseen = str(functional_numbering(request).numbers[3])
    with pytest.raises(BadReply, match="points"):
        annotator(ScriptedChat(functional(("rim", unseen), ("base", ids_of(chat.asked[0][0])[0])))).select_points(
            request
        )


def test_numbers_are_drawn_at_their_candidates_and_clean_views_stay_clean(request_of_mug: PointsRequest) -> None:
    request, numbering = request_of_mug, grasp_numbering(request_of_mug, 0, 3)
    views = numbering.views
    parts, color = marked_views(request, numbering.numbers, views.pictures, views.cameras, views.visible)
    assert color == "red"
    pictures = [np.asarray(Image.open(io.BytesIO(part.png))) for part in parts if isinstance(part, Picture)]
    captions = [part for part in parts if isinstance(part, str)]
    assert (
        len(pictures) == 17
        and "scale bar" in captions[-1]
        and captions[0] == "View 1 of 8, azimuth 300, elevation 20, clean:"
    )
    for view, camera in enumerate(request.subject.cameras):
        clean, marked = pictures[2 * view : 2 * view + 2]
        assert np.array_equal(clean, np.asarray(Image.open(request.subject.views[view]).convert("RGB")))
        pixels, _ = project(request.positions_m, camera)
        dots = {i for i, (x, y) in enumerate(pixels) if np.abs(marked[int(y), int(x)].astype(int) - DOT).max() < 12}
        assert dots >= set(request.visible[view])
        assert len(dots - set(request.visible[view])) <= 1  # one behind another's dot


def test_drawn_number_is_that_of_the_query(request_of_mug: PointsRequest) -> None:
    """One candidate alone in a view: its box reads differently under two numbers, and equally under one."""
    one = replace(request_of_mug, visible=((request_of_mug.visible[0][0],), *((),) * 7))

    def box(number: int) -> bytes:
        numbers = np.full(len(one.positions_m), number)
        views = own_views(one)
        parts, _ = marked_views(one, numbers, views.pictures, views.cameras, views.visible)
        return [part.png for part in parts if isinstance(part, Picture)][1]

    assert box(11) == box(11) and box(11) != box(12)


@pytest.mark.usefixtures("without_pictures")
def test_neighbours_support_each_other(request_of_mug: PointsRequest) -> None:
    request = request_of_mug
    near = nearest(request, (0, 0.04, 0.05), 2)
    positions, normals = request.positions_m.copy(), request.normals.copy()
    positions[near[1]], normals[near[1]] = positions[near[0]] + [0, 0, 0.019], normals[near[0]]  # less than 2 cm away
    request = replace(request, positions_m=positions, normals=normals)
    far = nearest(request, (0.075, 0, 0.05))[0]

    def answer(question: Question) -> dict[str, Any]:
        wall = near[0] if question.vote < 2 else near[1]
        return by_place(request, ("body", wall, "power", 0.6), ("handle", far, "parallel_jaw", 0.9))(question)

    selected = annotator(ScriptedChat(good_functional(request), answer)).select_points(request)
    assert [point.candidate for point in selected.grasp] == [far, near[0]]
    assert [point.confidence for point in selected.grasp] == [0.9, 0.6] and selected.findings == ()


def _voted(
    request: PointsRequest, *by_vote: list[tuple[str, int, str, float]]
) -> tuple[tuple[GraspPoint, ...], tuple[str, ...]]:
    chat = ScriptedChat(good_functional(request), lambda question: by_place(request, *by_vote[question.vote])(question))
    selected = annotator(chat).select_points(request)
    assert selected.findings is not None
    return selected.grasp, selected.findings


@pytest.mark.usefixtures("without_pictures")
def test_support_comes_before_confidence_and_a_tie_is_said(request_of_mug: PointsRequest) -> None:
    request = request_of_mug
    back, wall = nearest(request, (-0.04, 0, 0.05))[0], nearest(request, (0, 0.04, 0.05))[0]
    handle, other = nearest(request, (0.075, 0, 0.05))[0], nearest(request, (0, -0.04, 0.02))[0]
    grasp, findings = _voted(
        request,
        [("body", back, "power", 0.5), ("handle", handle, "parallel_jaw", 1.0)],
        [("body", back, "power", 0.5), ("body", wall, "power", 0.6)],
        [("body", back, "power", 0.5), ("body", other, "power", 0.6)],
    )
    assert [point.candidate for point in grasp] == [back, handle]
    assert [point.confidence for point in grasp] == [0.5, pytest.approx(1 / 3, abs=1e-3)]
    assert any("g1" in finding and "1 of 3" in finding for finding in findings)
    grasp, findings = _voted(
        request,
        [("body", back, "power", 0.5), ("body", wall, "power", 0.6)],
        [("body", back, "power", 0.5), ("body", other, "power", 0.6)],
        [("body", back, "power", 0.5), ("handle", handle, "parallel_jaw", 0.6)],
    )
    assert any("tied" in finding for finding in findings)


@pytest.mark.usefixtures("without_pictures")
def test_contradicted_label_is_asked_again_then_marked_and_trusted_less(request_of_mug: PointsRequest) -> None:
    request = request_of_mug
    numbers = functional_numbering(request).numbers
    base, back = nearest(request, (0, 0, 0))[0], nearest(request, (-0.04, 0, 0.05))[0]
    wrong = functional(("handle", str(numbers[back])), ("base", str(numbers[base])))
    votes = by_place(request, ("body", back, "power", 0.8), ("base", base, "power", 0.8))
    chat = ScriptedChat(wrong, wrong, votes)
    selected = annotator(chat).select_points(request)
    assert f"marker {numbers[back]}, 'handle'" in chat.complaint() and f"marker {numbers[base]}" not in chat.complaint()
    assert [point.confidence for point in selected.functional] == [0.4, 0.8]
    assert selected.findings is not None and len(selected.findings) == 1 and "f0" in selected.findings[0]
    corrected = annotator(ScriptedChat(wrong, good_functional(request), votes)).select_points(request)
    assert corrected.findings == () and {point.confidence for point in corrected.functional} == {0.8}


@pytest.mark.usefixtures("without_pictures")
def test_grasp_wider_than_the_fingers_is_asked_again_then_marked(request_of_mug: PointsRequest) -> None:
    request = replace(request_of_mug, max_opening_m=0.004)  # the wall has 3 mm, the handle 10
    handle, back = nearest(request, (0.075, 0, 0.05))[0], nearest(request, (-0.04, 0, 0.05))[0]
    votes = by_place(request, ("handle", handle, "parallel_jaw", 0.8), ("body", back, "power", 0.8))
    selected = annotator(ScriptedChat(good_functional(request), votes)).select_points(request)
    assert [(point.candidate, point.confidence) for point in selected.grasp] == [(back, 0.8), (handle, 0.4)]
    assert selected.findings is not None and any(
        "fingers of a parallel_jaw" in finding for finding in selected.findings
    )


@pytest.mark.usefixtures("without_pictures")
def test_one_vote_asks_twice_in_all(request_of_mug: PointsRequest) -> None:
    votes = by_place(request_of_mug, ("body", 1, "power", 0.9), ("body", 2, "power", 0.8))
    chat = ScriptedChat(good_functional(request_of_mug), votes)
    selected = annotator(chat, votes=1).select_points(request_of_mug)
    assert len(chat.asked) == 2 and [point.confidence for point in selected.grasp] == [0.9, 0.8]


@pytest.mark.usefixtures("without_pictures")
def test_number_written_as_a_number_is_the_same_id(request_of_mug: PointsRequest) -> None:
    answer = good_functional(request_of_mug)
    for point in answer["points"]:
        point["id"] = int(point["id"])
    votes = by_place(request_of_mug, ("body", 1, "power", 0.9), ("body", 2, "power", 0.8))
    assert len(annotator(ScriptedChat(answer, votes)).select_points(request_of_mug).functional) == 2


def test_each_vote_has_other_views_order_numbers_and_words(request_of_mug: PointsRequest) -> None:
    votes = by_place(request_of_mug, ("body", 1, "power", 0.9), ("body", 2, "power", 0.8))
    chat = ScriptedChat(good_functional(request_of_mug), votes)
    annotator(chat).select_points(request_of_mug)
    grasp = sorted((question for question, _ in chat.asked[1:]), key=lambda question: question.vote)
    captions = [[p for p in q.parts if isinstance(p, str) and p.endswith("clean:")] for q in grasp]
    azimuths = [[int(caption.split("azimuth ")[1].split(",")[0]) for caption in one] for one in captions]
    assert not set(azimuths[1]) & set(azimuths[0]) and not set(azimuths[2]) & {*azimuths[0], *azimuths[1]}
    assert all(sorted(one) != one and len(one) == 8 for one in azimuths[1:])
    pngs = [{p.png for p in q.parts if isinstance(p, Picture)} for q in grasp]
    assert not pngs[0] & pngs[1] and not pngs[1] & pngs[2]
    words = [" ".join(p for p in q.parts if isinstance(p, str) and not p.startswith("View")) for q in grasp]
    assert len({text.split(".")[-2] for text in words}) == 3 and len({q.instructions for q in grasp}) == 1


@pytest.mark.usefixtures("without_pictures")
def test_votes_are_asked_at_the_same_time(request_of_mug: PointsRequest) -> None:
    votes = by_place(request_of_mug, ("body", 1, "power", 0.9), ("body", 2, "power", 0.8))
    together = threading.Barrier(3, timeout=30)  # one after the other, the first would wait for ever

    def answer(question: Question) -> dict[str, Any]:
        together.wait()
        return votes(question)

    selected = annotator(ScriptedChat(good_functional(request_of_mug), answer)).select_points(request_of_mug)
    assert [point.candidate for point in selected.grasp] == [1, 2]


@pytest.mark.usefixtures("without_pictures")
def test_mirrored_places_support_each_other(request_of_mug: PointsRequest) -> None:
    request = request_of_mug
    left, far = nearest(request, (0, 0.04, 0.05))[0], nearest(request, (0.075, 0, 0.05))[0]
    right = nearest(request, (0, -0.04, 0.05))[0]
    positions, normals = request.positions_m.copy(), request.normals.copy()
    positions[right], normals[right] = positions[left] * [1, -1, 1], normals[left] * [1, -1, 1]
    request = replace(request, positions_m=positions, normals=normals)

    def answer(question: Question) -> dict[str, Any]:
        side = right if question.vote == 1 else left
        return by_place(request, ("body", side, "power", 0.9), ("handle", far, "parallel_jaw", 0.8))(question)

    selected = annotator(ScriptedChat(good_functional(request), answer)).select_points(request)
    assert [(p.candidate, p.confidence) for p in selected.grasp] == [
        (left, 0.9),
        (far, 0.8),
    ] and selected.findings == ()


def test_widths_are_listed_and_what_is_known_is_said(request_of_mug: PointsRequest) -> None:
    subject = replace(request_of_mug.subject, name=None, known_as="coffee mug", size_estimated=True)
    checks = PlaceChecks(replace(request_of_mug, subject=subject))
    numbering = grasp_numbering(checks.request, 0, 3)
    question = grasp_question(checks, numbering, load_prompts(None)["grasp_points"], 0)
    said = [part for part in question.parts if isinstance(part, str)]
    handle = nearest(request_of_mug, (0.075, 0, 0.05))[0]
    width = checks.width_phrase(handle)
    assert f"; {numbering.numbers[handle]}: " in said[-1] and f" mm, {width}" in said[-1] and width.endswith(" mm")
    assert "it was recognised as: coffee mug." in said[0]
    assert "estimated from pictures, not measured" in said[0] and "measured size is" not in said[0]
