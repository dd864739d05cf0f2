import json
from pathlib import Path

import numpy as np
import pytest

from manitwin.dataset.index.rows import rows_of
from manitwin.errors import TwinError
from manitwin.twin.shape_file import SHAPE, compute_shape, read_shape, shape_to_json
from twin_folders import twin_name, write_accepted


def described(root: Path) -> Path:
    folder = root / twin_name(write_accepted(root, 1))
    (folder / SHAPE).write_bytes(shape_to_json(compute_shape(folder / "visual.glb")))
    return folder


def test_shape_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    folder = described(tmp_path)
    said, measured = read_shape(folder), compute_shape(folder / "visual.glb")
    assert said is not None and said.values.dtype == np.float32
    assert np.array_equal(said.values, measured.values) and said.radius_of_gyration_m == measured.radius_of_gyration_m


def test_twin_of_an_earlier_version_has_none(tmp_path: Path) -> None:
    assert read_shape(tmp_path / twin_name(write_accepted(tmp_path, 1))) is None


def test_row_is_that_of_the_mesh_and_reads_none(tmp_path: Path) -> None:
    plain = rows_of(tmp_path / twin_name(write_accepted(tmp_path, 1)))
    folder = described(tmp_path)
    (folder / "visual.glb").unlink()
    assert rows_of(folder) == plain


@pytest.mark.parametrize(
    "change",
    [
        {"descriptor": [0.1] * 65},
        {"descriptor": [0.1] * 65 + ["a"]},
        {"descriptor": None},
        {"radius_of_gyration_m": None},
        {"radius_of_gyration_m": 1e300},
    ],
)
def test_damaged_file_is_named(tmp_path: Path, change: dict[str, object]) -> None:
    folder = described(tmp_path)
    (folder / SHAPE).write_text(json.dumps(json.loads((folder / SHAPE).read_text()) | change))
    with pytest.raises(TwinError, match=r"shape\.json.*build the twin again"):
        rows_of(folder)


def test_file_that_is_no_object_is_named(tmp_path: Path) -> None:
    folder = described(tmp_path)
    (folder / SHAPE).write_text("[]")
    with pytest.raises(TwinError, match=r"shape\.json"):
        read_shape(folder)
