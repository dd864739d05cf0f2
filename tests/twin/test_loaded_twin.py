from __future__ import annotations

import json
import shutil
from pathlib import Path

import fsspec
import pytest

from grasped_twins import write_brick
from manitwin.errors import TwinError, UsageError
from manitwin.twin.fill_records import Filling
from manitwin.twin.loaded_twin import Twin, TwinSource
from manitwin.twin.store import RECORD, canonical_json, revision_of
from twin_folders import write_set


def test_twins_are_found_in_a_data_set_and_in_a_flat_folder(tmp_path: Path) -> None:
    ids = write_set(tmp_path / "set", accepted=2, rejected=1)
    in_set = TwinSource(tmp_path / "set")
    for twin_id in ids:
        shutil.copytree(in_set.folder(twin_id), tmp_path / "flat" / twin_id)
    (tmp_path / "flat" / "notes").mkdir()
    flat = TwinSource(tmp_path / "flat")
    assert in_set.twin_ids() == flat.twin_ids() == sorted(ids)
    assert flat.twin(ids[0]).record == in_set.twin(ids[0]).record
    assert flat.record_bytes(ids[1]) == in_set.record_bytes(ids[1])
    for source in (flat, in_set):
        with pytest.raises(UsageError, match="no twin ffff"):
            source.folder("ffff")
        with pytest.raises(UsageError, match="no twin ffff"):
            source.record_bytes("ffff")


def test_twins_of_a_url_are_copied_once(tmp_path: Path) -> None:
    ids = write_set(tmp_path / "set", accepted=1, rejected=0)
    memory = fsspec.filesystem("memory")
    memory.put(str(tmp_path / "set") + "/", "/twin-source/", recursive=True)
    try:
        source = TwinSource("memory://twin-source", cache=tmp_path / "cache")
        assert source.twin_ids() == ids
        assert source.twin(ids[0]).record == TwinSource(tmp_path / "set").twin(ids[0]).record
        memory.rm("/twin-source/twins", recursive=True)
        assert source.folder(ids[0]) == tmp_path / "cache" / ids[0]
        with pytest.raises(UsageError, match="local folder"):
            TwinSource("memory://twin-source")
    finally:
        memory.rm("/twin-source", recursive=True)


def test_a_body_is_that_of_the_fill_state_asked_for(tmp_path: Path) -> None:
    [twin_id] = write_set(tmp_path / "set", accepted=1, rejected=0)
    folder = TwinSource(tmp_path / "set").folder(twin_id)
    with pytest.raises(UsageError, match="has no fill states"):
        Twin(folder).rigid_body(fill=0.5)
    said = json.loads((folder / RECORD).read_text())
    moments = [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]
    states = [
        {
            "share": share,
            "mass_kg": 0.1 + share / 5,
            "center_of_mass_m": [0, 0, 0.04 + share / 100],
            "inertia_kg_m2": moments,
        }
        for share in (0.0, 0.5, 1.0)
    ]
    said["physical"]["filling"] = {"assumption": "level", "states": states}
    said["revision"] = revision_of(said)
    (folder / RECORD).write_text(canonical_json(said))
    twin = Twin(folder)
    half = twin.rigid_body(fill=0.5)
    assert (half.mass_kg, half.center_of_mass_m.tolist()) == (pytest.approx(0.2), [0, 0, pytest.approx(0.045)])
    assert twin.rigid_body().mass_kg == twin.physical.mass_kg.value
    with pytest.raises(UsageError, match=r"unknown fill '0.3'.*0, 0.5, 1"):
        twin.rigid_body(fill=0.3)


@pytest.mark.parametrize("order", [(1.0, 0.5), (0.0,), ()])
def test_fill_states_out_of_order_are_refused(order: tuple[float, ...]) -> None:
    states = [
        {"share": s, "mass_kg": 1 + s, "center_of_mass_m": [0] * 3, "inertia_kg_m2": [[0] * 3] * 3} for s in order
    ]
    with pytest.raises(ValueError):
        Filling.model_validate({"assumption": "level", "states": states})


def test_a_place_that_is_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="this folder does not exist"):
        TwinSource(tmp_path / "nowhere")


def test_missing_twins_are_counted_before_any_is_read(tmp_path: Path) -> None:
    ids = write_set(tmp_path / "set", accepted=2, rejected=0)
    source = TwinSource(tmp_path / "set")
    source.check(set(ids))
    with pytest.raises(UsageError, match=r"no twin ffff there \(2 of 4 are missing\).*--twins"):
        source.check({*ids, "gggg", "ffff"})


def test_a_data_set_that_is_given_as_a_twin_is_called_one(tmp_path: Path) -> None:
    write_set(tmp_path, accepted=1, rejected=0)
    with pytest.raises(TwinError, match=r"this is a data set: open it with `manitwin view` or manitwin\.Dataset"):
        Twin(tmp_path)


def test_a_twin_without_one_of_its_hulls_is_no_smaller_twin(tmp_path: Path) -> None:
    folder = TwinSource(tmp_path).folder(write_brick(tmp_path, 0))
    hulls = sorted((folder / "collision").iterdir())
    assert len(Twin(folder).hulls) == len(hulls)
    hulls[-1].unlink()
    with pytest.raises(TwinError, match=rf"collision/{hulls[-1].name} missing; build the twin again"):
        _ = Twin(folder).hulls
