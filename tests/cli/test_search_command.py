"""``manitwin search`` and ``manitwin catalog`` on the command line."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.dataset.index.rebuild import rebuild
from manitwin.dataset.search import appearance_vectors
from manitwin.twin.dataset_root import DatasetRoot
from scene_twins import can, slab, write_thing


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("set")
    for number, thing in enumerate((can(), slab("knife", 0.22, 0.02, 0.01, 0.08))):
        write_thing(root, number, thing)
    rebuild(DatasetRoot(root), jobs=1)
    return root


def run(*arguments: object) -> str:
    done = CliRunner().invoke(app, [str(each) for each in arguments])
    assert done.exit_code == 0, done.output
    return done.stdout


def test_words_and_a_picture_find_twins(dataset: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(appearance_vectors, "AROUND", 2)
    assert "knife" in run("search", dataset, "red knives", "--limit", 1)
    assert "no twin matches these words" in run("search", dataset, "xylophone")
    misspelt = CliRunner().invoke(app, ["search", str(dataset), "red nife"])
    assert "no twin has the word 'nife'; spelt nearly so: knife" in misspelt.output
    catalog = tmp_path / "catalog"
    assert "2 twins" in run("catalog", dataset, "-o", catalog, "--size", 96)
    picture = next(path for path in sorted(catalog.glob("pictures/knife-*/*_r_024.png")))
    quiet = CliRunner().invoke(app, ["--quiet", "search", str(dataset), "--image", str(picture)])
    assert quiet.exit_code == 0 and "embedded" not in quiet.output, (
        "twins are embedded for the first time, without a word"
    )
    found = json.loads(run("search", dataset, "--image", picture, "--json"))
    check_keys(found, "search")
    assert found["hits"][0]["category"] == "knife" and found["background"] == "border"
    told = json.loads(run("search", dataset, "knife", "--json"))
    check_keys(told, "search")
    assert told["hits"][0]["matched"]["knife"] and told["image"] is None


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ((), "give either a description"),
        (("mug", "--image", "IMAGE"), "give either a description"),
        (("--image", "IMAGE", "--embedder", "openai:x"), "applies to words only"),
    ],
)
def test_what_cannot_be_asked_is_refused(dataset: Path, tmp_path: Path, more: tuple[str, ...], said: str) -> None:
    (tmp_path / "x.png").write_bytes(b"")
    given = [str(tmp_path / "x.png") if each == "IMAGE" else each for each in more]
    done = CliRunner().invoke(app, ["search", str(dataset), *given])
    assert done.exit_code != 0 and said in str(done.exception)
