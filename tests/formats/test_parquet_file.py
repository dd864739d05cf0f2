"""Parquet of outsiders: one line for what is none, cut off, of other columns, or larger in memory than it says."""

import os
import struct
import subprocess
import sys
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from manitwin.errors import TwinError
from manitwin.formats.parquet_file import check_parquet, open_parquet, read_parquet

SCHEMA = pa.schema([("name", pa.string()), ("numbers", pa.list_(pa.float64()))])
ROWS = pa.table({"name": ["a", None, "b"], "numbers": [[1.0, 2.0], [], None]}, schema=SCHEMA)
REMEDY = "build the twin again"


def written(path: Path, table: pa.Table = ROWS, **how: object) -> Path:
    pq.write_table(table, path, **how)
    return path


def refused(path: Path, *, schema: pa.Schema | None = SCHEMA, inside: Path | None = None) -> str:
    with pytest.raises(TwinError) as caught:
        read_parquet(path, TwinError, schema=schema, remedy=REMEDY, inside=inside)
    said = str(caught.value)
    assert "\n" not in said and path.name in said
    return said


@pytest.mark.parametrize("how", [{}, {"compression": "zstd"}, {"data_page_version": "2.0"}, {"use_dictionary": False}])
def test_rows_are_those_of_the_file(tmp_path: Path, how: dict[str, object]) -> None:
    path = written(tmp_path / "a.parquet", ROWS.append_column("more", pa.array([1, 2, 3])), **how)
    assert read_parquet(path, TwinError, schema=SCHEMA, remedy=REMEDY).equals(ROWS)
    assert check_parquet(path, TwinError, schema=SCHEMA, remedy=REMEDY) == 3
    with open_parquet(path, TwinError, remedy=REMEDY) as file:
        assert file.names == ["name", "numbers", "more"]
        assert file.read(["more"], row_group=0).to_pydict() == {"more": [1, 2, 3]}


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in /proc")
def test_no_thread_of_pyarrow_holds_the_stream(tmp_path: Path) -> None:
    """One that lets go of it while the interpreter ends would abort the process."""
    written(tmp_path / "a.parquet", pa.table({f"c{number}": list(range(1000)) for number in range(100)}))
    program = (
        "import os, pathlib, manitwin.formats.parquet_file as formats\n"
        "before = len(os.listdir('/proc/self/task'))\n"
        "with formats.open_parquet(pathlib.Path('a.parquet'), ValueError, remedy='') as file:\n"
        "    file.read(); file.read(row_group=0)\n"
        "print(len(os.listdir('/proc/self/task')) - before)"
    )
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout == "0\n"


def test_table_without_rows_is_read(tmp_path: Path) -> None:
    path = written(tmp_path / "a.parquet", SCHEMA.empty_table())
    assert read_parquet(path, TwinError, schema=SCHEMA, remedy=REMEDY).equals(SCHEMA.empty_table())


@pytest.mark.parametrize("share", [0, 1, 4, 20, 50, 90, 99])
def test_file_cut_off_anywhere_is_refused(tmp_path: Path, share: int) -> None:
    path = written(tmp_path / "a.parquet")
    os.truncate(path, path.stat().st_size * share // 100)
    assert refused(path).endswith(REMEDY)


def test_altered_bytes_are_read_or_refused(tmp_path: Path) -> None:
    whole = written(tmp_path / "a.parquet").read_bytes()
    path = tmp_path / "b.parquet"
    for place in range(4, len(whole)):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xA5]) + whole[place + 1 :])
        try:
            read_parquet(path, TwinError, schema=SCHEMA, remedy=REMEDY)
        except TwinError as error:
            assert "\n" not in str(error)


def test_file_that_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.parquet").write_bytes(b"PAR1" + b"\0" * 100 + b"PAR1")
    assert "no Parquet file that can be read" in refused(tmp_path / "a.parquet")
    os.mkfifo(tmp_path / "pipe.parquet")
    assert "named pipe" in refused(tmp_path / "pipe.parquet")
    (tmp_path / "folder.parquet").mkdir()
    assert "folder" in refused(tmp_path / "folder.parquet")
    (tmp_path / "zero.parquet").symlink_to("/dev/zero")
    assert "device" in refused(tmp_path / "zero.parquet")
    (tmp_path / "inside").mkdir()
    (tmp_path / "inside/link.parquet").symlink_to(written(tmp_path / "outside.parquet"))
    assert "leads outside its folder" in refused(tmp_path / "inside/link.parquet", inside=tmp_path / "inside")
    refused(tmp_path / "not_there.parquet")


def test_columns_have_their_names_and_types(tmp_path: Path) -> None:
    path = tmp_path / "a.parquet"
    assert "has no column numbers" in refused(written(path, ROWS.select(["name"])))
    other = ROWS.set_column(1, "numbers", pa.array([["a"], ["b"], ["c"]]))
    assert "numbers is of type list<element: string>, not list<item: double>" in refused(written(path, other))
    integers = ROWS.set_column(0, "name", pa.array([1, 2, 3]))
    assert "name is of type int64, not string" in refused(written(path, integers))


def test_extension_types_are_not_made(tmp_path: Path) -> None:
    said = {
        b"ARROW:extension:name": b"arrow.py_extension_type",
        b"ARROW:extension:metadata": b"cos\nsystem\n(S'true'\ntR.",
    }
    field = pa.field("name", pa.binary(), metadata=said)
    table = ROWS.set_column(0, field, pa.array([b"a", b"b", b"c"]))
    refused(written(tmp_path / "a.parquet", table))
    assert read_parquet(tmp_path / "a.parquet", TwinError, remedy=REMEDY)["name"].type == pa.binary()


def test_text_that_repeats_is_measured_before_it_is_unfolded(tmp_path: Path) -> None:
    repeated = pa.DictionaryArray.from_arrays(pa.array([0] * 20_000, pa.int32()), ["x" * 1_000_000])
    path = written(tmp_path / "a.parquet", pa.table({"name": repeated}), store_schema=False)
    assert path.stat().st_size < 200_000
    assert "unfolds to 20000" in refused(path, schema=None)


def test_list_that_repeats_is_measured_by_its_pages(tmp_path: Path) -> None:
    path = written(tmp_path / "a.parquet", pa.table({"numbers": [[0.0] * 200_000]}))
    assert path.stat().st_size < 2_000
    with pytest.raises(TwinError, match=r"unfolds to 16000.. bytes or more, the limit is 1000000"):
        check_parquet(path, TwinError, remedy=REMEDY, max_bytes=1_000_000)


def test_more_rows_than_the_limit_are_refused(tmp_path: Path) -> None:
    with pytest.raises(TwinError, match="3 rows exceed the limit of 2"):
        check_parquet(written(tmp_path / "a.parquet"), TwinError, remedy=REMEDY, max_rows=2)


def test_footer_longer_than_the_file_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path / "a.parquet")
    content = path.read_bytes()
    path.write_bytes(content[:-8] + struct.pack("<I", 0xFFFFFFF0) + b"PAR1")
    assert "no Parquet file that can be read" in refused(path)
