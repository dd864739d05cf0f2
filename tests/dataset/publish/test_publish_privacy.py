"""Nothing that goes out names a folder, a person or a machine of this one."""

from __future__ import annotations

import io
import tarfile
import zipfile
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from made_twins import index, make_dataset, make_twin

from manitwin.dataset.publish.privacy import check_part, local_paths
from manitwin.dataset.publish.publish import publish_dataset
from manitwin.errors import TwinError
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import read_record, write_twin_record


def texts(name: str, content: bytes) -> list[bytes]:
    """A file's bytes and, of archives and tables, what is in them."""
    found = [content]
    if name.endswith(".tar"):
        with tarfile.open(fileobj=io.BytesIO(content)) as tar:
            for member in tar:
                found += texts(member.name, tar.extractfile(member).read())
    elif name.endswith("collision.zip"):
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            found += [archive.read(entry) for entry in archive.infolist()]
    elif name.endswith(".parquet"):
        found.append(repr(pq.read_table(io.BytesIO(content)).to_pylist()).encode())
    return found


def test_no_byte_that_goes_out_names_the_data_sets_folder_or_the_machine(dataset: Path, published: Path) -> None:
    secret = [str(dataset).encode(), str(published.parent).encode(), b"alice", b"secret-host", b".work"]
    seen = 0
    for path in (p for p in published.rglob("*") if p.is_file()):
        for text in texts(path.name, path.read_bytes()):
            seen += 1
            assert not any(word in text for word in secret), path
    assert seen > 50, "members of shards and rows of tables were looked at"


def test_scan_would_find_the_folder(tmp_path: Path) -> None:
    root = make_dataset(tmp_path / "set")
    assert any(
        str(root).encode() in text
        for p in (root / "index").rglob("*.parquet")
        for text in texts(p.name, p.read_bytes())
    )


@pytest.mark.parametrize(
    ("words", "refused"),
    [
        ("a mug of /home/bob/photos/mug.png", True),
        ("/Users/bob/mug.png", True),
        ("C:\\Users\\bob\\mug.png", True),
        ("https://example.org/home/bob/mug and https://example.org/Users/bob/", False),
        ("at home/work and in the users/kitchen", False),
    ],
)
def test_folder_of_a_person_in_a_twins_words_is_refused(tmp_path: Path, words: str, refused: bool) -> None:
    root = tmp_path / "set"
    make_twin(root, "a0", prompt=words)
    index(root)
    if not refused:
        publish_dataset(root, tmp_path / "out")
        return
    with pytest.raises(TwinError, match=r"a0/twin\.json: names the folder"):
        publish_dataset(root, tmp_path / "out")
    assert not list((tmp_path / "out").rglob("*.tar"))


def test_folder_of_the_data_set_is_found_in_any_part(dataset: Path) -> None:
    places = local_paths([DatasetRoot(dataset)])
    with pytest.raises(TwinError, match=r"visual\.glb"):
        check_part("a0", "visual.glb", b"\x00glTF" + str(dataset).encode() + b"/photo.png\xff", places)
    check_part("a0", "source.txt", b"/home/author/mug.mtl", places)


def test_source_with_a_folder_in_its_name_is_refused(tmp_path: Path) -> None:
    root = tmp_path / "set"
    folder = make_twin(root, "a0")
    record = read_record(folder).model_dump(mode="json", exclude={"revision"})
    write_twin_record(folder, {**record, "source": {**record["source"], "file": "photos/source.zip"}})
    index(root)
    with pytest.raises(TwinError, match="not a file name"):
        publish_dataset(root, tmp_path / "out")
