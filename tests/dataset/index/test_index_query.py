from pathlib import Path

import fsspec
import pyarrow as pa
import pytest

from imported_modules import imported_of
from manitwin.dataset.index.parts import compact, rows_of_twins, write_part
from manitwin.dataset.index.query import Index
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from twin_folders import twin_id, write_rejected, write_set

HOSTILE = [
    "1=1; COPY twins TO 'STOLEN'",
    "1=1); COPY twins TO 'STOLEN'; SELECT (1=1",
    "true) UNION ALL SELECT * FROM rejections WHERE (true",
    "1=1) OR (1=1",
    "1=1 /*",
    "exists(SELECT 1 FROM read_text('SECRET'))",
    "exists(SELECT 1 FROM read_csv('SECRET'))",
    "exists(SELECT 1 FROM 'SECRET')",
    'exists(SELECT 1 FROM "SECRET")',
    "exists(SELECT 1 FROM glob('/*'))",
    "exists(FROM query('SELECT 1'))",
    "exists(FROM duckdb_settings())",
    "exists(SELECT 1 FROM information_schema.tables)",
    "exists(SELECT 1 FROM temp.twins)",
    "twin_id IN (SELECT content FROM (VALUES (1)) JOIN read_text('SECRET') ON true)",
    "exists(WITH a AS (SELECT * FROM read_text('SECRET')) SELECT * FROM a)",
    "exists(DESCRIBE twins)",
    "read_text('SECRET') IS NOT NULL",
    "mass_kg = ?",
    "true FROM twins",
    "true WHERE true",
    "true LIMIT 1",
    "true AS a",
    "true, true",
    "DISTINCT true",
    "*",
    "count(*) > 0",
    "",
    "(" * 5000 + "true" + ")" * 5000,
    "SET enable_external_access = true",
    "INSTALL httpfs",
]


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> DatasetRoot:
    place = tmp_path_factory.mktemp("set")
    ids = write_set(place)
    root = DatasetRoot(place)
    write_part(root, ids[::2])
    write_part(root, ids[1::2])
    return root


@pytest.fixture(scope="module")
def index(root: DatasetRoot) -> Index:
    return Index(root)


def test_condition_finds_what_a_loop_finds(root: DatasetRoot, index: Index) -> None:
    rows = [row for each in rows_of_twins(root, root.twin_ids()) for row in each["twins"].to_pylist()]
    wanted = sorted(r["twin_id"] for r in rows if r["category"] in ("mug", "can") and r["mass_kg"] < 0.5)
    found = index.select("twins", "category in ('mug', 'can') and mass_kg < 0.5", columns=["twin_id", "mass_kg"])
    assert found["twin_id"].to_pylist() == wanted and len(wanted) == 3
    assert index.count("twins", "category in ('mug', 'can') and mass_kg < 0.5") == 3


def test_rows_come_sorted_and_with_the_types_of_their_table(root: DatasetRoot, index: Index) -> None:
    each = {
        row["twins"]["twin_id"][0].as_py() if len(row["twins"]) else "": row
        for row in rows_of_twins(root, root.twin_ids())
    }
    for name, schema in TABLES.items():
        found = index.select(name)
        assert found.schema == schema
        assert found["twin_id"].to_pylist() == sorted(found["twin_id"].to_pylist())
    grasps = index.select("grasps", f"twin_id = '{twin_id(4)}'")
    assert grasps.equals(each[twin_id(4)]["grasps"])  # best first, as in the twin's own file


def test_conditions_add_up_and_columns_and_limit_cut(index: Index) -> None:
    found = index.select("grasps", ["verified", "category = 'mug' -- mugs"], columns=["grasp_id", "twin_id"], limit=3)
    assert found.column_names == ["grasp_id", "twin_id"] and len(found) == 3
    assert index.count("grasps", ["verified", "category = 'mug'"]) == index.count(
        "grasps", "verified and category = 'mug'"
    )
    assert index.select(limit=0).num_rows == 0


def test_subquery_on_another_table_of_the_index_is_allowed(index: Index) -> None:
    light = "twin_id in (select twin_id from twins where mass_kg < 0.15)"
    assert index.count("grasps", light) == 8  # the lightest twin has eight grasps


@pytest.mark.parametrize("condition", HOSTILE)
def test_hostile_condition_is_refused_in_one_line(index: Index, tmp_path: Path, condition: str) -> None:
    (tmp_path / "secret.txt").write_text("secret")
    condition = condition.replace("SECRET", str(tmp_path / "secret.txt")).replace("STOLEN", str(tmp_path / "stolen"))
    with pytest.raises(UsageError) as refused:
        index.count("twins", condition)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 1500
    assert sorted(path.name for path in tmp_path.iterdir()) == ["secret.txt"]


@pytest.mark.parametrize(
    "statement",
    [
        "SELECT * FROM read_text('SECRET')",
        "SELECT * FROM read_parquet('SECRET')",
        "COPY twins TO 'STOLEN'",
        "COPY (SELECT 1) TO 'LIVE' (FORMAT parquet)",
        "ATTACH 'STOLEN'",
        "EXPORT DATABASE 'STOLEN'",
        "SET enable_external_access = true",
        "SET allowed_paths = ['/']",
        "SET autoinstall_known_extensions = true",
        "INSTALL httpfs",
        "LOAD httpfs",
        "SELECT * FROM tmp_path",
    ],
)
def test_connection_itself_reads_and_writes_nothing_else(
    root: DatasetRoot, index: Index, tmp_path: Path, statement: str
) -> None:
    import duckdb

    (tmp_path / "secret.txt").write_text("secret")
    live = root.full(index.parts.parts[0].file("twins"))
    places = {"SECRET": str(tmp_path / "secret.txt"), "STOLEN": str(tmp_path / "stolen"), "LIVE": live}
    for name, place in places.items():
        statement = statement.replace(name, place)
    before = Path(live).read_bytes()
    with pytest.raises(duckdb.Error):
        index.connection.execute(statement).fetchall()
    assert Path(live).read_bytes() == before
    assert [path.name for path in tmp_path.iterdir()] == ["secret.txt"]


def test_unknown_column_names_the_nearest_and_all(index: Index) -> None:
    with pytest.raises(UsageError, match=r"'catgory'; did you mean 'category'.*Valid: approach_octants, .*watertight"):
        index.count("twins", "catgory = 'mug'")
    with pytest.raises(UsageError, match="a text is written 'mug'"):
        index.count("twins", 'category = "mug"')
    with pytest.raises(UsageError, match="did you mean 'mass_kg'"):
        index.select(columns=["mas_kg"])
    with pytest.raises(UsageError, match="unknown table 'twin'; did you mean 'twins'"):
        index.select("twin")


@pytest.mark.parametrize(
    ("condition", "message"),
    [("mass_kg <", "syntax error.*give one SQL condition such as"), ("mass_kg < 'heavy'", "Could not convert")],
)
def test_wrong_condition_says_why(index: Index, condition: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        index.count("twins", condition)


def test_every_column_can_be_written_without_quotes(root: DatasetRoot, index: Index) -> None:
    each = list(rows_of_twins(root, root.twin_ids()))
    for table in TABLES:
        rows = pa.concat_tables([of_twin[table] for of_twin in each])
        known = {name: len(rows) - rows[name].null_count for name in rows.column_names}
        assert len(rows) and {name: index.count(table, f"{name} is not null") for name in known} == known


def test_no_index_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="give the folder or URL that manitwin build wrote"):
        Index(tmp_path).count()
    (tmp_path / "twins").mkdir()
    with pytest.raises(UsageError, match="has no index; run manitwin index"):
        Index(tmp_path).count()


def test_index_of_rejected_twins_alone_can_be_asked(tmp_path: Path) -> None:
    root = DatasetRoot(tmp_path)
    write_part(root, [write_rejected(tmp_path, 1)])
    assert Index(root).count("twins", "mass_kg < 1") == 0
    assert Index(root).count("rejections", "reason = 'several_objects'") == 1


@pytest.mark.parametrize("url", ["", "memory://outlived"])
def test_open_index_outlives_a_merge(tmp_path: Path, url: str) -> None:
    ids = write_set(tmp_path, accepted=2, rejected=1)
    root = DatasetRoot(url or tmp_path)
    if url:
        root.fs.put(f"{tmp_path}/twins", root.full("twins"), recursive=True)
    opened = Index(root)
    for each in ids:
        write_part(root, [each])
    assert opened.count() == 2
    compact(root)
    assert opened.count("grasps") == 17
    root.remove(opened.parts.parts[0].file("twins"))
    with pytest.raises(UsageError, match=r"cannot be read .*run manitwin check"):
        opened.select()
    root.remove("index")


def test_index_behind_a_url_is_read_and_locked_too(root: DatasetRoot, index: Index) -> None:
    import duckdb

    files = fsspec.filesystem("memory")
    remote = DatasetRoot("memory://queried")
    for name in root.names_below("index"):
        remote.write_bytes(name, root.read_bytes(name))
    files.pipe_file("/queried/secret.txt", b"secret")
    asked = Index(remote)
    assert asked.select("grasps", "verified").equals(index.select("grasps", "verified"))
    with pytest.raises(duckdb.PermissionException):
        asked.connection.execute("SELECT * FROM read_text('memory:///queried/secret.txt')").fetchall()
    files.rm("/queried", recursive=True)


def test_query_imports_neither_meshes_nor_simulation() -> None:
    assert imported_of({"trimesh", "scipy", "sapien", "cv2"}, "manitwin.dataset.index.query") == set()
