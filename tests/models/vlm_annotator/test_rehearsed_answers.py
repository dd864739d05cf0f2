"""The rehearsal's answers pass the annotator's own checks for real meshes whose names are given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from scripted_chat import ScriptedChat, annotator, points_request

from handmade import mug
from manitwin.models.annotators.protocol import PointsRequest
from manitwin.models.fakes.vlm_answers import rehearsal_answer
from manitwin.models.vlm.protocol import Picture, Question, Reply, Turn
from real_meshes import load_real_mesh, mesh_rows


class RehearsingChat(ScriptedChat):
    """Answers as the fake servers do: by the whole text, what was said to be wrong included."""

    def ask(self, question: Question, turns: tuple[Turn, ...] = ()) -> Reply:
        texts = [
            question.instructions,
            *(p for p in question.parts if isinstance(p, str)),
            *(turn.text for turn in turns),
        ]
        pngs = [part.png for part in question.parts if isinstance(part, Picture)]
        self.answers = [rehearsal_answer(question.name, question.schema, "\n".join(texts), pngs)]
        return super().ask(question, turns)


def check(request: PointsRequest) -> None:
    seen = annotator(RehearsingChat({}))
    verdict = seen.judge_quality(request.subject)
    assert verdict.single_object and verdict.visual_quality
    for metric in (True, False):
        assert seen.estimate_physical(replace(request.subject, metric=metric)).findings == ()
    language = seen.describe(request.subject, "plastic", request.subject.solid.extents)
    assert len(language.captions) == 8 and len(set(language.captions)) == 8
    selected = seen.select_points(request)
    assert selected.findings == () and all(point.confidence >= 0.3 for point in selected.grasp)


def test_mug_passes(tmp_path: Path) -> None:
    check(points_request(mug(), tmp_path, "mug"))


@pytest.mark.shared_data
@pytest.mark.slow
@pytest.mark.parametrize("name", ["fork", "mug_ycb", "cracker_box", "frypan_8in", "sneaker", "headset", "toy_dinosaur"])
def test_real_mesh_passes(shared_data: Path, tmp_path: Path, name: str) -> None:
    row = mesh_rows(shared_data)[name]
    check(points_request(load_real_mesh(shared_data, name), tmp_path, row["category"]))
