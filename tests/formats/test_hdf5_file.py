"""HDF5 of outsiders: nothing outside of the file is read, no filter is loaded, no array is larger than it was written."""

import os
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import h5py
import numpy as np
import pytest

from manitwin.errors import EpisodesError
from manitwin.formats.hdf5_file import Hdf5

REMEDY = "write the episodes again"


def opened(path: Path) -> closing[Hdf5]:
    return closing(Hdf5(path, EpisodesError, remedy=REMEDY))


def refused(path: Path, ask: Callable[[Hdf5], object]) -> str:
    with pytest.raises(EpisodesError) as caught, opened(path) as file:
        ask(file)
    said = str(caught.value)
    assert "\n" not in said and said.startswith(str(path))
    return said


def sound(path: Path) -> Path:
    with h5py.File(path, "w") as file:
        file["a/b"] = np.arange(6.0).reshape(2, 3)
        file.create_dataset("a/packed", data=np.zeros(10_000), compression="gzip", shuffle=True, fletcher32=True)
        file["a/flags"] = np.array([True, False])
        file["a"].attrs["said"] = np.bytes_(b"{}")
    return path


def test_sound_file_is_read(tmp_path: Path) -> None:
    with opened(sound(tmp_path / "a.h5")) as file:
        assert file.names() == ["a"] and file.names("a") == ["b", "flags", "packed"]
        assert file.array("a/b").tolist() == [[0, 1, 2], [3, 4, 5]] and file.length("a/b") == 2
        assert file.array("a/packed").shape == (10_000,) and file.array("a/flags").dtype == bool
        assert file.text("a", "said") == b"{}" and file.text("a", "other") is None
        assert file.has("a/b") and not file.has("a/c") and len(file.group("a")) == 3


@pytest.mark.parametrize("share", [0, 3, 30, 60, 95])
def test_file_cut_off_is_refused(tmp_path: Path, share: int) -> None:
    path = sound(tmp_path / "a.h5")
    os.truncate(path, path.stat().st_size * share // 100)
    assert refused(path, lambda file: file.array("a/packed")).endswith(REMEDY)


def test_what_is_no_file_is_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.h5")
    (tmp_path / "zero.h5").symlink_to("/dev/zero")
    (tmp_path / "folder.h5").mkdir()
    causes = {"pipe.h5": "a named pipe", "zero.h5": "a device", "folder.h5": "a folder", "gone.h5": "No such file"}
    for name, cause in causes.items():
        assert cause in refused(tmp_path / name, lambda file: file.names())


def test_links_are_not_followed(tmp_path: Path) -> None:
    sound(tmp_path / "outside.h5")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["out"] = h5py.ExternalLink("outside.h5", "/a/b")
        file["group"] = h5py.ExternalLink("outside.h5", "/a")
        file["soft"] = h5py.SoftLink("/out")
    path = tmp_path / "a.h5"
    for where in ("out", "soft"):
        assert "is a link" in refused(path, lambda file, where=where: file.array(where))  # type: ignore[misc]
    assert "is a link" in refused(path, lambda file: file.array("group/b"))
    assert "is a link" in refused(path, lambda file: file.group("/"))


def test_arrays_that_lie_in_other_files_are_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.bin").write_bytes(b"\7" * 80)
    sound(tmp_path / "outside.h5")
    layout = h5py.VirtualLayout(shape=(2, 3), dtype=float)
    layout[:] = h5py.VirtualSource(tmp_path / "outside.h5", "a/b", shape=(2, 3))
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("external", (10,), float, external=[(str(tmp_path / "secret.bin"), 0, 80)])
        file.create_virtual_dataset("virtual", layout)
    for where in ("external", "virtual"):
        assert "is stored in other files" in refused(
            tmp_path / "a.h5", lambda file, where=where: file.array(where)  # type: ignore[misc]
        )  # fmt: skip
    assert "is stored in other files" in refused(tmp_path / "a.h5", lambda file: file.group("/"))


def test_filter_of_a_plugin_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        made = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        made.set_chunk((10,))
        made.set_filter(32015, h5py.h5z.FLAG_OPTIONAL, ())
        h5py.h5d.create(file.id, b"a", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((10,)), made)
    assert "has the filter 32015, but plugins are not loaded" in refused(path, lambda file: file.array("a"))


def test_numbers_that_were_never_written_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("huge", (1 << 50,), np.uint8, chunks=(1 << 20,))
        file.create_dataset("empty", (1 << 20,), np.float64, chunks=(1 << 10,), compression="gzip")
        file.create_dataset("chunk", (4,), np.float64, chunks=(1 << 28,), maxshape=(None,), compression="gzip")
    assert "1125899906842624 bytes exceed the limit" in refused(path, lambda file: file.array("huge"))
    assert "declares 8388608 bytes, but 0 were written" in refused(path, lambda file: file.array("empty"))
    assert "2147483648 bytes exceed the limit" in refused(path, lambda file: file.array("chunk"))


def test_types_other_than_numbers_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        file["text"] = "abc"
        file["reference"] = np.array([file.ref], dtype=h5py.ref_dtype)
        file.create_dataset("ragged", (2,), dtype=h5py.vlen_dtype(np.float64))
        file["rows"] = np.zeros(3, [("a", float)])
        file.attrs["said"] = "of any length"
        file.attrs["many"] = np.zeros(3)
    for where in ("text", "reference", "ragged", "rows"):
        assert "not of numbers" in refused(path, lambda file, where=where: file.array(where))  # type: ignore[misc]
    for name in ("said", "many"):
        assert "is not a text" in refused(path, lambda file, name=name: file.text("/", name))  # type: ignore[misc]


def test_group_that_contains_itself_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        inner = file.create_group("a").create_group("b")
        inner["again"] = file["a/b"]
    assert "links back" in refused(path, lambda file: file.group("a"))


def test_altered_bytes_are_read_or_refused(tmp_path: Path) -> None:
    whole = sound(tmp_path / "a.h5").read_bytes()
    path, rng = tmp_path / "b.h5", np.random.default_rng(3)
    for _ in range(300):
        content = bytearray(whole)
        for place in rng.integers(8, len(content), 3):
            content[place] = rng.integers(256)
        path.write_bytes(content)
        try:
            with opened(path) as file:
                file.group("a")
                for name in file.names("a"):
                    file.array(f"a/{name}")
        except EpisodesError as error:
            assert "\n" not in str(error)
