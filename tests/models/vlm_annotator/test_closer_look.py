"""The closer look: a set of places around each point, on its part, seen from nearby; the chosen one is where the point goes."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
import pytest
from PIL import Image
from scripted_chat import ScriptedChat, annotator, points_request

from handmade import mug
from manitwin.errors import BadReply
from manitwin.models.annotators.protocol import CloserLook, LooksCloser, PointsRequest
from manitwin.models.annotators.rules import RulesAnnotator
from manitwin.models.annotators.vlm.closer_look import PLACES, PlaceSet, nearby_places
from manitwin.models.annotators.vlm.place_checks import PlaceChecks
from manitwin.models.vlm.protocol import Picture, Question
from manitwin.render.cameras import project
from manitwin.twin.point_records import FunctionalPoint

REACH_M = 0.15 * 0.115  # of the mug's longest side, from its wall to its handle


@pytest.fixture(scope="module")
def request_of_mug(tmp_path_factory: pytest.TempPathFactory) -> PointsRequest:
    return points_request(mug(), tmp_path_factory.mktemp("views"), "mug")


def point(request: PointsRequest, number: int, label: str, place: tuple[float, float, float]) -> FunctionalPoint:
    seen = sorted({i for view in request.visible for i in view})
    nearest = min(seen, key=lambda i: float(np.linalg.norm(request.positions_m[i] - place)))
    return FunctionalPoint(
        id=f"f{number}", **request.place(nearest), label=label, description="a use", confidence=0.8, rationale="there"
    )


@pytest.fixture(scope="module")
def points(request_of_mug: PointsRequest) -> list[FunctionalPoint]:
    return [
        point(request_of_mug, 0, "rim", (0, 0.0385, 0.1)),
        point(request_of_mug, 1, "handle", (0.055, 0, 0.078)),
    ]


@pytest.fixture(scope="module")
def nearby(request_of_mug: PointsRequest, points: list[FunctionalPoint]) -> list[PlaceSet]:
    return nearby_places(PlaceChecks(request_of_mug), points, 256)


def highest(of: PlaceSet) -> str:
    return str(of.numbers[int(of.positions_m[:, 2].argmax())])


def test_places_are_around_the_point_on_its_part_and_in_the_picture(
    nearby: list[PlaceSet], points: list[FunctionalPoint]
) -> None:
    assert [each.letter for each in nearby] == ["A", "B"]
    for each, asked in zip(nearby, points, strict=True):
        assert len(each.numbers) == PLACES and sorted(each.numbers) == list(range(1, len(each.numbers) + 1))
        away_m = np.linalg.norm(each.positions_m - asked.position_m, axis=1)
        assert away_m.min() == 0 and away_m.max() <= REACH_M
        apart_m = np.linalg.norm(each.positions_m[:, None] - each.positions_m[None], axis=2)
        assert apart_m[~np.eye(PLACES, dtype=bool)].min() > 0.1 * REACH_M, "no two dots are at one place"
        pixels, _ = project(each.positions_m, each.camera)
        assert (pixels > 0).all() and (pixels < 256).all()
        assert np.ptp(pixels, axis=0).max() > 0.3 * 256, "it is seen from nearby"
    handle = nearby[1].positions_m
    assert (np.hypot(handle[:, 0], handle[:, 1]) > 0.0395).all(), "none is on the wall beside the handle"


def test_chosen_places_come_back_by_point_and_the_own_place_is_no_move(
    request_of_mug: PointsRequest, nearby: list[PlaceSet], points: list[FunctionalPoint]
) -> None:
    rim, handle = nearby
    own = str(handle.numbers[int(np.linalg.norm(handle.positions_m - points[1].position_m, axis=1).argmin())])
    answer = {"A": {"rationale": "the edge", "id": highest(rim)}, "B": {"rationale": "as it is", "id": int(own)}}
    chat = ScriptedChat(answer)
    seen = annotator(chat, picture_px=256)
    assert isinstance(seen, LooksCloser) and not isinstance(RulesAnnotator(), LooksCloser)
    look = seen.look_closer(request_of_mug, points)
    places = look.places
    assert {name: picture.shape for name, picture in look.pictures.items()} == {
        "f0": (256, 256, 3),
        "f1": (256, 256, 3),
    }
    assert set(places) == {"f0"} or (set(places) == set() and rim.positions_m[:, 2].max() == points[0].position_m[2])
    for place in places.values():
        assert place.position_m[2] == rim.positions_m[:, 2].max() >= points[0].position_m[2]
    question: Question = chat.asked[0][0]
    shown = [Image.open(io.BytesIO(part.png)).size for part in question.parts if isinstance(part, Picture)]
    assert shown == [(256, 256)] * 4, "each point clean and with markers"
    text = " ".join(part for part in question.parts if isinstance(part, str))
    assert "'rim'" in text and "'handle'" in text and "points A, B" in text
    assert question == seen.questions(request_of_mug, "ceramic", np.full(3, 0.1), points)[4]


def test_number_of_another_picture_is_no_answer(
    request_of_mug: PointsRequest, nearby: list[PlaceSet], points: list[FunctionalPoint]
) -> None:
    beyond: dict[str, Any] = {each.letter: {"rationale": "", "id": "13"} for each in nearby}
    with pytest.raises(BadReply, match="closer_look"):
        annotator(ScriptedChat(beyond), picture_px=256).look_closer(request_of_mug, points)


def test_point_that_no_view_shows_is_not_asked_about(
    request_of_mug: PointsRequest, points: list[FunctionalPoint]
) -> None:
    hidden = points[0].model_copy(update={"candidate": 1000})
    assert [each.point.id for each in nearby_places(PlaceChecks(request_of_mug), [hidden, points[1]], 256)] == ["f1"]
    chat = ScriptedChat({})
    assert annotator(chat).look_closer(request_of_mug, [hidden]) == CloserLook() and not chat.asked
