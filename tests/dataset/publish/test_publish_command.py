from __future__ import annotations

from pathlib import Path

import pytest
import typer
from made_twins import index, make_dataset, make_twin
from typer.testing import CliRunner

from manitwin.cli.commands.publish import publish
from manitwin.errors import UsageError

app = typer.Typer()
app.command()(publish)


def test_command_says_what_went_out_and_what_did_not(tmp_path: Path) -> None:
    make_dataset(tmp_path / "set")
    arguments = [str(tmp_path / "set"), "-o", str(tmp_path / "out")]
    done = CliRunner().invoke(app, arguments)
    assert done.exit_code == 0, done.output
    assert "6 twins in 2 shards; 13 files" in done.output
    assert "1 left out by licence: unknown 1" in done.output
    assert "1 rejected twins are not published" in done.output
    again = CliRunner().invoke(app, [*arguments, "--license-allow", "CC-BY-4.0,unknown", "--name", "Mugs"])
    assert "6 twins in 3 shards, 1 of them unchanged" in again.output
    assert "1 left out by licence: CC0-1.0 1" in again.output
    assert "# Mugs" in (tmp_path / "out" / "README.md").read_text()


def test_missing_attribution_is_said(tmp_path: Path) -> None:
    make_twin(tmp_path / "set", "a0", attribution=None)
    index(tmp_path / "set")
    done = CliRunner().invoke(app, [str(tmp_path / "set"), "-o", str(tmp_path / "out")])
    assert "1 have a licence that requires attribution, but no attribution" in done.output


def test_rehearsals_are_left_out_with_their_count_unless_asked_for(tmp_path: Path) -> None:
    make_twin(tmp_path / "set", "a0")
    make_twin(tmp_path / "set", "b1", failed_checks=("rehearsal",))
    index(tmp_path / "set")
    arguments = [str(tmp_path / "set"), "-o", str(tmp_path / "out")]
    done = CliRunner().invoke(app, arguments)
    assert "1 twins in 1 shards" in done.output and "1 left out: made with a rehearsal server" in done.output
    asked = CliRunner().invoke(app, [*arguments, "--with-rehearsals"])
    assert "2 twins in" in asked.output and "left out" not in asked.output


def test_wrong_licence_is_a_usage_error(tmp_path: Path) -> None:
    make_dataset(tmp_path / "set")
    done = CliRunner().invoke(app, [str(tmp_path / "set"), "-o", str(tmp_path / "out"), "--license-allow", "MIT"])
    assert isinstance(done.exception, UsageError) and "CC0-1.0 (1)" in str(done.exception)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("option", ["--shard-size-mb", "--twins-per-shard"])
def test_bounds_are_checked(tmp_path: Path, option: str) -> None:
    make_dataset(tmp_path / "set")
    done = CliRunner().invoke(app, [str(tmp_path / "set"), "-o", str(tmp_path / "out"), option, "0"])
    said = " ".join(done.output.replace("│", " ").split())
    assert done.exit_code == 2 and option in said and "greater than or equal to 1" in said
    assert not (tmp_path / "out").exists()
