from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial.transform import Rotation

from manitwin.errors import Rejected, UsageError
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.layouts.placing import LEVELS
from manitwin.scenes.layouts.pool import Pool, PoolTwin, StandingPose, read_pool
from manitwin.scenes.layouts.sample import sample_layout
from manitwin.scenes.loaded_scene import Scene
from manitwin.scenes.scene import SceneRecord
from manitwin.scenes.scene_files import scene_bytes
from manitwin.scenes.settings import LayoutSettings
from manitwin.twin.loaded_twin import TwinSource
from scene_twins import BOWL_HEIGHT_M, BOWL_RADIUS_M, distances_in_mujoco, pool_of_things, slab, write_things

TOUCHES_M = 0.001
POOL = pool_of_things()


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root: Path = tmp_path_factory.mktemp("twins")
    write_things(root)
    return root


def layout(seed: int = 1, number: int = 0, **settings: object) -> SceneRecord:
    return sample_layout(POOL, LayoutSettings(**settings), seed, number)


@pytest.mark.parametrize("clutter", ["sparse", "medium", "dense"])
def test_gaps_and_penetration_are_as_mujoco_measures_them(dataset: Path, clutter: str) -> None:
    for number in range(2):
        record = layout(number=number, objects=(6, 8), clutter=clutter)
        found = distances_in_mujoco(Scene(record, TwinSource(dataset)))
        objects = {each.name for each in record.objects}
        between = [gap for (a, b), gap in found.items() if a in objects and b in objects]
        assert min(between) > LEVELS[clutter].min_gap_m - 2e-4  # settling moves things by less
        assert record.measures.min_gap_m == pytest.approx(min(between), abs=1e-4)
        assert min(found.values()) > -1e-3
        for name in objects:
            assert abs(found["table", name]) < TOUCHES_M


def test_same_number_is_the_same_layout_whatever_came_before(dataset: Path) -> None:
    first = scene_bytes(layout(seed=5, number=7, objects=(5, 8)))
    layout(seed=5, number=8, surface="shelf")
    assert scene_bytes(layout(seed=5, number=7, objects=(5, 8))) == first
    assert scene_bytes(layout(seed=6, number=7, objects=(5, 8))) != first
    code = (
        "import sys; from manitwin.scenes.layouts.pool import read_pool;"
        "from manitwin.scenes.layouts.sample import sample_layout;"
        "from manitwin.scenes.settings import LayoutSettings; from manitwin.scenes.scene_files import scene_bytes;"
        f"pool = read_pool({str(dataset)!r});"
        "sys.stdout.buffer.write(scene_bytes(sample_layout(pool, LayoutSettings(objects=(5, 8)), 5, 7)))"
    )
    own = scene_bytes(sample_layout(read_pool(dataset), LayoutSettings(objects=(5, 8)), 5, 7))
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=True).stdout == own


def test_number_of_objects_is_within_what_is_asked(dataset: Path) -> None:
    counts = {len(layout(number=number, objects=(2, 5)).objects) for number in range(10)}
    assert counts <= {2, 3, 4, 5} and len(counts) > 2


def test_categories_asked_for_are_there() -> None:
    for number in range(3):
        record = layout(number=number, objects=(4, 4), include=("bowl", "box", "Box"))
        categories = [each.category for each in record.objects]
        assert categories[0] == "mixing bowl"
        assert set(categories[1:3]) == {"box", "tea box"}
        assert len(record.objects) == 4
    with pytest.raises(UsageError, match="no twin of category 'kettle'; there are: board, box"):
        layout(include=("kettle",))


def test_objects_stand_where_the_robot_reaches() -> None:
    near, far, half_deg = 0.4, 0.7, 40.0
    for number in range(3):
        record = layout(number=number, objects=(3, 6), workspace=(near, far, half_deg))
        for each in record.objects:
            x, y, _ = each.position_m
            assert near - 0.005 <= np.hypot(x, y) <= far + 0.005
            assert abs(np.degrees(np.arctan2(y, x))) <= half_deg + 1
    with pytest.raises(UsageError, match="the table lies outside the workspace"):
        layout(workspace=(2.0, 3.0, 30.0))


@pytest.mark.parametrize("surface", ["shelf", "tray"])
def test_objects_stand_within_the_supports_and_below_what_is_above(dataset: Path, surface: str) -> None:
    used = set()
    for number in range(3):
        record = layout(number=number, surface=surface, objects=(4, 7))
        scene = Scene(record, TwinSource(dataset))
        supports = {each.name: each for each in record.furniture.supports}
        for placed, recorded in zip(scene.placed_objects(), record.objects, strict=True):
            support = supports[recorded.surface]
            used.add(support.name)
            corners = np.vstack([transform_points(placed.object_to_world, hull) for hull in placed.body.hulls])
            assert corners[:, 2].min() == pytest.approx(support.height_m, abs=1e-3)
            assert (np.abs(corners[:, :2] - support.center_m) <= np.array(support.half_extents_m) + 1e-3).all()
            if support.clearance_m is not None:
                assert corners[:, 2].max() < support.height_m + support.clearance_m
        assert min(distances_in_mujoco(scene).values()) > -1e-3
    assert len(used) == (2 if surface == "shelf" else 1)


def test_what_is_in_the_bowl_is_in_it(dataset: Path) -> None:
    for number in range(3):
        record = layout(number=number, objects=(4, 6), include=("bowl",), contained=1)
        [inside] = [each for each in record.objects if each.relation == "in"]
        vessel = next(each for each in record.objects if each.name == inside.supported_by)
        assert vessel.category == "mixing bowl" and inside.placement is None
        scene = Scene(record, TwinSource(dataset))
        placed = next(each for each in scene.placed_objects() if each.name == inside.name)
        corners = np.vstack([transform_points(placed.object_to_world, hull) for hull in placed.body.hulls])
        lowest = corners[corners[:, 2].argmin()] - vessel.position_m
        assert np.hypot(*lowest[:2]) < BOWL_RADIUS_M and lowest[2] < BOWL_HEIGHT_M
        found = distances_in_mujoco(scene)
        touched = {other for pair, gap in found.items() if inside.name in pair and gap < TOUCHES_M for other in pair}
        assert touched == {inside.name, vessel.name}


def test_what_is_stacked_rests_on_what_it_should(dataset: Path) -> None:
    for number in range(3):
        record = layout(number=number, objects=(5, 6), stacked=2)
        found = distances_in_mujoco(Scene(record, TwinSource(dataset)))
        stacked = [each for each in record.objects if each.supported_by is not None]
        assert len(stacked) == 2 and len({each.supported_by for each in stacked}) == 2
        for each in stacked:
            touched = {other for pair, gap in found.items() if each.name in pair and gap < TOUCHES_M for other in pair}
            assert touched == {each.name, each.supported_by}


@pytest.mark.parametrize("number", range(3))
def test_what_cannot_carry_is_not_asked_to(number: int) -> None:
    asked = {"include": ("bowl", "knife"), "stacked": 1, "contained": 1}
    record = layout(number=number, objects=(4, 6), **asked)
    stacked = next(each for each in record.objects if each.relation == "on" and each.supported_by)
    below = next(each for each in record.objects if each.name == stacked.supported_by)
    assert below.category not in ("mixing bowl", "knife")  # a rim, and 2 cm wide
    with pytest.raises(UsageError, match=r"none of bowl, knife has a level top .* allow 5 objects"):
        layout(number=number, objects=(4, 4), **asked)


def test_what_was_measured_is_within_the_limits() -> None:
    record = layout(objects=(6, 8), stacked=1, contained=1, include=("bowl",))
    assert record.measures.max_moved_m <= 0.01
    assert record.measures.max_turned_rad <= np.radians(5)
    assert record.measures.max_penetration_m <= 0.001


def test_what_has_no_room_is_rejected_with_its_reason() -> None:
    boards = pool_of_things((slab("board", 0.4, 0.4, 0.015),))
    with pytest.raises(Rejected) as caught:
        sample_layout(boards, LayoutSettings(surface="tray", objects=(3, 3)), 1, 0)
    assert caught.value.reason == "no_room" and caught.value.stage == "layout"


def test_what_does_not_stay_is_rejected_with_its_reason() -> None:
    body = slab("box", 0.06, 0.06, 0.12).body()
    turn = Rotation.from_euler("x", 20, degrees=True).as_matrix()  # on its edge: it falls back by 20 degrees
    lift = -float((body.hulls[0] @ turn.T)[:, 2].min())
    on_edge = StandingPose(0, transform(turn, np.array([0, 0, lift])), 1.0, 0.1)
    pool = Pool([PoolTwin("aa", "ab", "box", (on_edge,), False)], lambda _: body)
    with pytest.raises(Rejected, match="turned by 20") as caught:
        sample_layout(pool, LayoutSettings(objects=(1, 1), repairs=2, max_moved_m=0.1), 1, 0)
    assert caught.value.reason == "unstable"
    assert "2 repairs" in caught.value.detail


def pool_that_mostly_lies() -> Pool:
    """Bottles that stand once in 25 times, and rulers that have no upright placement, though one that does not stay."""
    bottle, ruler = slab("bottle", 0.06, 0.06, 0.2), slab("ruler", 0.2, 0.03, 0.01)
    on_its_side = transform(Rotation.from_euler("y", 90, degrees=True).as_matrix(), np.array([-0.1, 0, 0.03]))
    standing = StandingPose(0, np.eye(4), 0.04, 0.05, upright=True)
    lying = StandingPose(1, on_its_side, 0.96, 0.12)
    flat = StandingPose(2, np.eye(4), 1.0, 0.11)
    bodies = {"b0": bottle, "b1": bottle, "r0": ruler, "r1": ruler}
    twins = [
        PoolTwin(name, "ab", thing.category, (flat,) if thing is ruler else (lying, standing), False)
        for name, thing in bodies.items()
    ]
    return Pool(twins, lambda name: bodies[name].body())


def axis_up(record: SceneRecord, category: str) -> list[float]:
    return [
        float(Rotation.from_quat(each.quaternion_wxyz, scalar_first=True).as_matrix()[2, 2])
        for each in record.objects
        if each.category == category
    ]


def test_upright_layouts_hold_only_standing_bottles_and_rulers_as_they_rest() -> None:
    pool = pool_that_mostly_lies()
    lain = 0
    for number in range(3):
        asked = {"objects": (4, 4), "include": ("bottle", "bottle", "ruler")}
        record = sample_layout(pool, LayoutSettings(upright=True, **asked), 1, number)
        assert min(axis_up(record, "bottle")) > np.cos(np.radians(5))
        assert {each.placement for each in record.objects if each.category == "bottle"} == {0}
        assert {each.placement for each in record.objects if each.category == "ruler"} == {2}
        as_drawn = sample_layout(pool, LayoutSettings(**asked), 1, number)
        lain += sum(up < 0.1 for up in axis_up(as_drawn, "bottle"))
    assert lain >= 4  # of 6 or more: what this test would see without the setting


def test_what_is_stacked_in_an_upright_layout_stands_too() -> None:
    record = sample_layout(
        pool_that_mostly_lies(),
        LayoutSettings(upright=True, objects=(2, 2), stacked=1, include=("bottle",)), 1, 0,
    )  # fmt: skip
    stacked = next(each for each in record.objects if each.supported_by)
    assert stacked.category != "bottle" or axis_up(record, "bottle")[-1] > 0.99
    assert record.objects[0].placement == 0


def test_no_vessel_to_fill_says_so() -> None:
    boxes = pool_of_things((slab("box", 0.1, 0.1, 0.1), slab("dice", 0.03, 0.03, 0.03)))
    with pytest.raises(UsageError, match="container that can hold another"):
        sample_layout(boxes, LayoutSettings(contained=1), 1, 0)


@pytest.mark.parametrize(
    "settings",
    [
        {"objects": (5, 3)},
        {"objects": (0, 3)},
        {"objects": (1, 3), "stacked": 2},
        {"objects": (1, 2), "include": ("a", "b"), "contained": 1},
        {"workspace": (0.5, 0.4, 30.0)},
    ],
)
def test_settings_that_cannot_be_are_refused(settings: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        LayoutSettings(**settings)


def test_lights_and_cameras_look_at_what_there_is() -> None:
    for surface in ("table", "shelf", "tray"):
        record = layout(surface=surface, objects=(3, 3))
        assert 1 <= len(record.lights) <= 3
        assert all(light.direction[2] < 0 for light in record.lights)
        assert [camera.name for camera in record.cameras] == ["front", "oblique", "overview"]
        for camera in record.cameras:
            forward = np.subtract(camera.target_m, camera.position_m)
            forward /= np.linalg.norm(forward)
            for each in record.objects:
                toward = np.subtract(each.position_m, camera.position_m)
                assert forward @ toward / np.linalg.norm(toward) > np.cos(camera.fov_y_rad / 2)
