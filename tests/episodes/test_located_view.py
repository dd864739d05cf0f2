"""From where a thing was found to what an arm does there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from located_views import BrickView, brick_view
from manitwin.episodes.attempts import ATTEMPTS, read_attempts
from manitwin.episodes.collect import collect
from manitwin.episodes.episodes_run import make_episodes
from manitwin.episodes.located_view import LocatedView
from manitwin.episodes.settings import TrajectoriesConfig
from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform
from manitwin.scenes.locate.layout_files import NoLayout, dataset_of_twin, write_layout
from manitwin.scenes.locate.located_scene import LocatedScene


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> BrickView:
    return brick_view(tmp_path_factory.mktemp("brick"))


def place_of(seen: BrickView, x_m: float, robot: str = "panda") -> LocatedView:
    """The brick where it is, with the robot's base so far behind it."""
    camera_to_base = transform(None, np.array([x_m, 0.1, 0.0])) @ inverse(seen.object_to_camera)
    return LocatedView(seen.view, [(seen.thing(seen.object_to_camera), seen.twin)], camera_to_base, robot)


def test_grasps_in_reach_come_first_and_of_a_far_thing_none_is_reached(seen: BrickView) -> None:
    near, far = place_of(seen, 0.5).grasps(0), place_of(seen, 1.6).grasps(0)
    assert near is not None and far is not None
    assert near.robot == "panda" and len(near.grasps) == len(far.grasps) > 0
    assert near.grasps[0].reached and sum(bool(each.reached) for each in near.grasps) >= 4
    assert [each.reached for each in near.grasps] == sorted((each.reached for each in near.grasps), reverse=True)
    assert not any(each.reached for each in far.grasps)


def test_an_arm_that_has_no_jaws_is_refused(seen: BrickView) -> None:
    with pytest.raises(UsageError, match="grasps that are carried over need a two-jaw gripper"):
        place_of(seen, 0.5, robot="ur5_suction")


def test_a_located_scene_is_planned_in_as_any_layout(seen: BrickView, tmp_path: Path) -> None:
    scene = place_of(seen, 0.5).scene
    assert isinstance(scene, LocatedScene) and scene.record is not None and scene.record.robot == "panda"
    (tmp_path / "place").mkdir()
    dataset = dataset_of_twin(seen.twin.folder)
    assert dataset is not None
    write_layout(tmp_path / "place", scene, dataset)
    out = tmp_path / "episodes"
    assert (
        make_episodes(tmp_path / "place", out, 2, TrajectoriesConfig(seed=1, batch=2), executor="inline").exit_code == 0
    )
    collect(out, [])
    attempts = list(read_attempts(out / ATTEMPTS))
    assert {attempt.scene_id for attempt in attempts} == {"located_0_000000"}
    assert any(attempt.outcome == "kept" for attempt in attempts)


def test_a_side_of_the_thing_is_no_table_and_without_one_there_is_no_layout(seen: BrickView) -> None:
    place = place_of(seen, 0.5)
    depth = np.where(seen.mask, seen.view.depth_m, 0.0)
    alone = LocatedView(type(seen.view)(depth, seen.view.intrinsics), place.things)
    assert isinstance(alone.scene, NoLayout) and "only 0 known depths" in alone.scene.reason
