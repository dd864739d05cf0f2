"""Packages of unknown size whose names say what they hold, against the sides of real ones."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.config import MeshConfig
from manitwin.engine.stage import Draft
from manitwin.models.annotators.prior_names import find_prior
from manitwin.pipeline.item import Item
from manitwin.pipeline.mesh import MeshStage
from manitwin.pipeline.stated_volume import factor_to_hold, stated_volume_m3


@pytest.mark.parametrize(
    ("name", "litres"),
    [
        ("Bravo apple juice 2l", 2), ("milk 0,5 l", 0.5), ("cola can 330ml", 0.33), ("water bottle, 50 cl", 0.5),
        ("milk", None), ("milk 1-2 l", None), ("milk 1 l or 2 l", None), ("bucket 10 l", None), ("apple 1 l", None), (None, None),
    ],
)  # fmt: skip
def test_one_volume_of_a_closed_vessel_is_read(name: str | None, litres: float | None) -> None:
    found = stated_volume_m3(name, find_prior(name))
    assert found == (None if litres is None else pytest.approx(1e-3 * litres))


def _sized(
    name: str, solid: trimesh.Trimesh, folder: Path, *, metric: bool = False, **item: float
) -> tuple[dict, np.ndarray]:
    solid.export(folder / "generated.glb")
    fields = {"generation": {"rests": True, "metric": metric}}
    draft = Draft("id", Item("photo.jpg", name=name, **item), 0, fields, {"generated.glb": folder / "generated.glb"})
    geometry = MeshStage(MeshConfig()).run(draft, folder)["geometry"]
    with np.load(folder / "canonical.npz") as arrays:
        return geometry, np.sort(np.ptp(arrays["vertices"], axis=0))


@pytest.mark.parametrize(
    ("name", "sides", "longest_m"),
    [
        ("juice carton 1 l", (0.07, 0.22, 0.07), 0.22),  # a brick of 70 x 70 x 220 mm
        ("cola can 330 ml", (0.0635, 0.1155, 0.0635), 0.1155),
    ],
)
def test_a_package_is_as_large_as_what_holds_so_much(
    name: str, sides: tuple[float, float, float], longest_m: float, tmp_path: Path
) -> None:
    if "carton" in name:
        solid = trimesh.creation.box([5 * side for side in sides])
    else:  # +Y up, as a generator's
        solid = trimesh.creation.cylinder(5 * sides[0] / 2, 5 * sides[1], sections=64)
        solid.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))
    geometry, found_m = _sized(name, solid, tmp_path)
    assert (geometry["metric"], geometry["units"]) == (True, "user")
    assert found_m[-1] == pytest.approx(longest_m, rel=0.05)


def test_a_stated_side_and_a_known_size_come_first(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.07, 0.3, 0.07))
    assert _sized("milk 1 l", box, tmp_path, longest_side_m=0.25)[1][-1] == pytest.approx(0.25)
    assert _sized("milk 1 l", box, tmp_path, metric=True)[1][-1] == pytest.approx(0.3)
    geometry, _ = _sized("milk", box, tmp_path)
    assert not geometry["metric"]


def test_walls_of_glass_make_a_bottle_larger() -> None:
    solid = trimesh.creation.cylinder(0.5, 3.0)
    glass, plastic = (factor_to_hold(solid, 5e-4, find_prior(name)) for name in ("glass bottle", "water bottle"))
    assert glass is not None and plastic is not None and 1.1 < (glass / plastic) ** 3 < 1.5
