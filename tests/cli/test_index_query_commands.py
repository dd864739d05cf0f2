import csv
import io
import json
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner, Result

from manitwin.cli.commands.maintenance import index
from manitwin.cli.commands.query import query
from manitwin.dataset.index.query import Index
from manitwin.dataset.index.tables import TABLES
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot
from twin_folders import write_set

app = typer.Typer()
app.command()(index)
app.command()(query)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def output(*arguments: object) -> str:
    done = run(*arguments)
    assert done.exit_code == 0, done.exception
    return done.stdout


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("set")
    write_set(place, accepted=3, rejected=1)
    said = output("index", place, "--jobs", 1)
    assert said == f"3 accepted, 1 rejected, 27 grasps indexed in {place}\n"
    return place


def test_query_prints_a_table_for_people(place: Path) -> None:
    lines = output("query", place, "category = 'mug' and mass_kg < 0.4").splitlines()
    assert lines[0].split() == ["twin_id", "name", "category", "mass_kg", "longest_m", "verified", "success_rate"]
    assert lines[1].split()[1:] == ["thing", "mug", "0.1", "0.1", "3", "0.5"]
    assert lines[2] == "1 row"


def test_query_writes_csv_that_reads_back(place: Path) -> None:
    rows = list(csv.DictReader(io.StringIO(output("query", place, "verified", "--table", "grasps", "--format", "csv"))))
    assert list(rows[0]) == TABLES["grasps"].names
    assert len(rows) == Index(place).count("grasps", "verified")
    assert len(json.loads(rows[0]["quaternion_wxyz"])) == 4 and rows[0]["pregrasp_joints_rad"] == ""


def test_query_writes_json_that_reads_back(place: Path) -> None:
    found = json.loads(output("query", place, "--columns", "twin_id, failed_checks", "--limit", 2, "--format", "json"))
    assert found == Index(place).select(columns=["twin_id", "failed_checks"], limit=2).to_pylist()
    assert json.loads(output("query", place, "false", "--format", "json")) == []


def test_query_writes_each_id_once(place: Path) -> None:
    lines = output("query", place, "verified", "--table", "grasps", "--format", "ids").splitlines()
    assert lines == Index(place).select(columns=["twin_id"])["twin_id"].to_pylist()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("catgory = 'mug'",), "did you mean 'category'"),
        (("mass_kg <",), "syntax error"),
        (("--columns", "mas"), "did you mean 'mass_kg'"),
        (("--table", "grasp"), "did you mean 'grasps'"),
        (("--format", "xml"), "unknown format 'xml'"),
        (("--format", "ids", "--columns", "name"), "leave out --columns"),
    ],
)
def test_wrong_query_is_a_usage_error(place: Path, arguments: tuple[str, ...], message: str) -> None:
    error = run("query", place, *arguments).exception
    assert isinstance(error, UsageError) and message in str(error)


def test_index_leaves_out_what_cannot_be_read_and_says_so(tmp_path: Path) -> None:
    ids = write_set(tmp_path, accepted=2, rejected=0)
    next(tmp_path.glob(f"twins/*/{ids[0]}/visual.glb")).unlink()
    done = run("index", tmp_path, "--jobs", 1)
    assert done.exit_code == 4 and f"{ids[0]}/visual.glb: missing" in " ".join(done.stderr.split())
    assert Index(DatasetRoot(tmp_path)).select(columns=["twin_id"])["twin_id"].to_pylist() == [ids[1]]


def test_index_of_no_data_set_is_a_usage_error(tmp_path: Path) -> None:
    error = run("index", tmp_path).exception
    assert isinstance(error, UsageError) and "not a data set" in str(error)
    assert not (tmp_path / "index").exists()


def test_reader_that_closes_the_pipe_is_no_error(place: Path) -> None:
    code = "import sys, typer; from manitwin.cli.commands.query import query; sys.argv[0] = 'query'; typer.run(query)"
    many = ["--table", "stages", "--format", "json"]
    command = [sys.executable, "-c", code, str(place), *many]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None and running.stderr is not None
        running.stdout.close()
        assert running.stderr.read() == b""
        assert running.wait(60) == 0
