"""The blind baseline against maps and parts whose scores follow from a formula."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from manitwin.dataset.affordances.baselines import baseline_part_accuracy, baseline_scores, part_shares
from manitwin.dataset.affordances.report import affordances_page


def maps_of(points_m: Any, parts: Any = (), names: tuple[str, ...] = (), **maps: Any) -> Any:
    record = SimpleNamespace(parts=[SimpleNamespace(name=name) for name in names])
    return SimpleNamespace(
        points_m=np.asarray(points_m, float), maps={name: np.asarray(values, float) for name, values in maps.items()},
        parts=np.asarray(parts, np.uint8), twin=SimpleNamespace(record=record),
    )  # fmt: skip


LINE = [[x, 0, 0] for x in (-2, -1, 0, 1, 2)]


def test_a_map_that_is_the_baseline_scores_as_such() -> None:
    found = baseline_scores(maps_of(LINE, same=[1] * 5, middle=[0, 0.5, 1, 0.5, 0], ends=[1, 0, 0, 0, 1], none=[0] * 5))
    assert found["same"].uniform_sim == pytest.approx(1) and np.isnan(found["same"].middle_auc)
    assert found["middle"].middle_sim == pytest.approx(1) and found["middle"].middle_auc == 1
    assert found["middle"].uniform_sim == pytest.approx(3 / 5)  # min(1/5, [0, 1/4, 1/2, 1/4, 0]) summed
    assert found["ends"].middle_auc == 0 and found["ends"].middle_sim == pytest.approx(0)
    assert found["none"].uniform_sim == 0


def test_parts_are_guessed_from_other_twins_of_the_category_alone() -> None:
    shares = part_shares(maps_of([[0, 0, 0]] * 5, parts=[0, 0, 0, 1, 255], names=("body", "handle")))
    assert shares == {"body": 0.75, "handle": 0.25}
    rows = [
        {"category": "mug", "part_shares": shares},
        {"category": "mug", "part_shares": {"body": 0.4, "handle": 0.6}},
        {"category": "mug", "part_shares": {"body": 0.9, "rim": 0.1}},
        {"category": "fork", "part_shares": {"tines": 1.0}},
        {"category": "pen", "part_shares": {}},
    ]
    # of each mug the other two have more body than anything else; of the fork there is no other
    assert baseline_part_accuracy(rows) == (pytest.approx((0.75 + 0.4 + 0.9) / 3), 3)
    assert baseline_part_accuracy(rows[3:]) == (None, 0)


def test_page_says_medians_by_kind_beside_the_agreement() -> None:
    row = {"category": "mug", "split": "train", "held": 1, "tried": 2, "maps": ["grasp"], "part_shares": {}}
    halves = {"grasp": [0.81, 0.9], "task_grasp:f1 rim": [0.62, None]}
    blind = {"task_grasp:f1 rim": [0.15, 0.2, 0.3]}
    rows = [{**row, "blind": {**blind, "grasp": [sim, 0.5, None]}, "agreement": halves} for sim in (0.25, 0.35, 0.75)]
    page = affordances_page(rows, {}, [], 0).decode()
    assert "Blind baseline" in page and "0.35" in page and "0.81" in page and "0.62" in page and "0.75" not in page
