"""A shard that somebody else made is trusted in nothing."""

from __future__ import annotations

import io
import json
import tarfile
import zipfile
from pathlib import Path

import pytest
from made_twins import make_twin

from manitwin.dataset.publish.shards import pack, parts_of, unpack, unpack_shard
from manitwin.errors import TwinError, UsageError
from manitwin.twin.store import RECORD, canonical_json, revision_of

ID = "a000000000000000"


def member(name: str, content: bytes = b"x", **fields: object) -> tuple[tarfile.TarInfo, bytes]:
    info = tarfile.TarInfo(name)
    info.size = len(content)
    for key, value in fields.items():
        setattr(info, key, value)
    return info, content


def write_tar(path: Path, members: list[tuple[tarfile.TarInfo, bytes]]) -> Path:
    with tarfile.open(path, "w") as tar:
        for info, content in members:
            tar.addfile(info, io.BytesIO(content) if info.isreg() else None)
    return path


def good_members(tmp_path: Path) -> dict[str, bytes]:
    """The parts of a sound sample."""
    folder = make_twin(tmp_path / "set", ID)
    files = {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}
    return {part: pack(names, files) for part, names in parts_of(files).items()}


def everything_below(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    "bad",
    [
        member("/etc/evil.twin.json"),
        member("../evil.twin.json"),
        member(f"{ID}.../../../evil"),
        member(f"{ID}/../../evil.json"),
        member(f"..{ID}.json"),
        member(f"{ID}.a\\..\\evil"),
        member("noextension"),
        member(f"{ID}.visual.glb", b"", type=tarfile.SYMTYPE, linkname="/etc/passwd"),
        member(f"{ID}.visual.glb", b"", type=tarfile.LNKTYPE, linkname="../../evil"),
        member(f"{ID}.pipe", b"", type=tarfile.FIFOTYPE),
        member(f"{ID}.device", b"", type=tarfile.CHRTYPE),
        member(f"{ID}.folder", b"", type=tarfile.DIRTYPE),
    ],
    ids=lambda bad: f"{bad[0].name}-{bad[0].type.decode()}",
)
def test_hostile_member_is_refused_and_nothing_is_written_outside(tmp_path: Path, bad: tuple) -> None:
    parts = good_members(tmp_path)
    before = everything_below(tmp_path)
    sample = [member(f"{ID}.{part}", content) for part, content in parts.items()]
    for members in ([bad, *sample], [*sample, bad]):
        tar = write_tar(tmp_path / "bad.tar", members)
        with pytest.raises(TwinError, match="not unpacked"):
            unpack_shard(tar, tmp_path / "out")
    written = everything_below(tmp_path) - before - {"bad.tar"}
    assert all(name.startswith(f"out/twins/a0/{ID}/") for name in written)
    assert not (tmp_path.parent / "evil").exists()


def test_sound_sample_is_unpacked(tmp_path: Path) -> None:
    parts = good_members(tmp_path)
    tar = write_tar(tmp_path / "good.tar", [member(f"{ID}.{part}", content) for part, content in parts.items()])
    assert unpack_shard(tar, tmp_path / "out") == [tmp_path / "out" / "twins" / "a0" / ID]


@pytest.mark.parametrize("change", ["altered", "missing", "unnamed", "twice", "no record", "other id"])
def test_sample_that_is_not_its_record_is_refused(tmp_path: Path, change: str) -> None:
    parts = good_members(tmp_path)
    key = ID
    if change == "altered":
        parts["card.png"] = b"other"
    elif change == "missing":
        del parts["card.png"]
    elif change == "unnamed":
        parts["evil.sh"] = b"rm"
    elif change == "no record":
        del parts[RECORD]
    elif change == "other id":
        key = "b000000000000000"
    members = [member(f"{key}.{part}", content) for part, content in parts.items()]
    if change == "twice":
        members.append(member(f"{key}.card.png"))
    with pytest.raises(TwinError):
        unpack_shard(write_tar(tmp_path / "bad.tar", members), tmp_path / "out")
    assert not everything_below(tmp_path / "out")


@pytest.mark.parametrize("file", ["../evil", "/evil", "views/../../evil", "collision\\evil", "", ".hidden", "a//b"])
def test_record_that_names_a_file_elsewhere_is_refused(tmp_path: Path, file: str) -> None:
    parts = good_members(tmp_path)
    record = json.loads(parts[RECORD])
    record["files"][file] = "0"
    record["revision"] = revision_of(record)
    parts[RECORD] = canonical_json(record).encode()
    tar = write_tar(tmp_path / "bad.tar", [member(f"{ID}.{part}", content) for part, content in parts.items()])
    with pytest.raises(TwinError, match=r"not a valid file name|is no file below the twin's folder"):
        unpack_shard(tar, tmp_path / "out")


def zipped(names: list[str], method: int = zipfile.ZIP_STORED) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", method) as archive:
        for name in names:
            archive.writestr(name, b"0" * 1000)
    return stream.getvalue()


@pytest.mark.parametrize(
    "content",
    [
        zipped(["hull_00.obj", "../evil"]),
        zipped(["../hull_00.obj"]),
        zipped(["hull_00.obj"], zipfile.ZIP_DEFLATED),
        b"no zip",
    ],
)
def test_hostile_archive_is_refused(content: bytes) -> None:
    with pytest.raises(TwinError, match=r"collision\.zip"):
        unpack(["collision/hull_00.obj"], content)


def test_archive_of_the_named_files_is_read() -> None:
    assert unpack(["collision/hull_00.obj"], zipped(["hull_00.obj"])) == {"collision/hull_00.obj": b"0" * 1000}


def test_two_files_cannot_become_one_part() -> None:
    with pytest.raises(TwinError, match=r"card\.png"):
        parts_of(["card.png", "views/card.png"])
    with pytest.raises(TwinError, match=r"collision\.zip"):
        parts_of(["collision.zip", "collision/hull_00.obj"])


def test_cut_off_shard_is_refused(tmp_path: Path) -> None:
    parts = good_members(tmp_path)
    tar = write_tar(tmp_path / "cut.tar", [member(f"{ID}.{part}", content) for part, content in parts.items()])
    tar.write_bytes(tar.read_bytes()[:3000])
    with pytest.raises(TwinError, match=r"download"):
        unpack_shard(tar, tmp_path / "out")
    with pytest.raises(UsageError, match=r"cannot be opened .No such file or directory.; check the path"):
        unpack_shard(tmp_path / "none.tar", tmp_path / "out")
