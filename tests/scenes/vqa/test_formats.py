"""Each format is read back by its real reader."""

from __future__ import annotations

import gc
import io
import json
import re
from pathlib import Path

import datasets
import pyarrow.parquet as pq
import pytest
import webdataset
from PIL import Image

from manitwin.errors import UsageError
from manitwin.scenes.vqa.question import Question
from manitwin.scenes.vqa.wording import word_question
from manitwin.scenes.vqa.write import write_vqa

PER_SCENE = 30


@pytest.fixture(scope="module")
def llava(scenes: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The questions in LLaVA's form."""
    out = tmp_path_factory.mktemp("vqa") / "llava"
    done = write_vqa(scenes, out, per_scene=PER_SCENE, validation_share=0.0)
    assert done.questions <= 2 * PER_SCENE
    assert done.pictures == len(list((out / "images").iterdir()))
    return out


def test_llava_is_what_its_reader_takes(llava: Path) -> None:
    rows = json.loads((llava / "train.json").read_text())
    assert len({row["id"] for row in rows}) == len(rows)
    for row in rows:
        Image.open(llava / "images" / row["image"]).verify()
        assert [turn["from"] for turn in row["conversations"]] == ["human", "gpt"]
        human, gpt = (turn["value"] for turn in row["conversations"])
        assert human.startswith("<image>\n")
        assert human.count("<image>") == 1
        assert gpt
        assert not re.search(r"<[pb]\d>", human + gpt)


def test_the_truth_and_the_page_lie_beside(llava: Path) -> None:
    lines = [json.loads(line) for line in (llava / "questions.jsonl").read_text().splitlines()]
    assert len(lines) == len(json.loads((llava / "train.json").read_text()))
    assert all(line["evidence"]["objects"] for line in lines)
    page = (llava / "report.html").read_text()
    assert "Questions by family" in page
    assert "What words alone answer" in page
    assert "<img" in page


def test_parquet_is_read_by_datasets(scenes: Path, tmp_path: Path) -> None:
    done = write_vqa(scenes, tmp_path / "out", "parquet", per_scene=PER_SCENE, validation_share=0.0)
    read = datasets.load_dataset(
        "parquet",
        data_files=str(tmp_path / "out/data/train-*.parquet"),
        split="train",
        cache_dir=str(tmp_path / "cache"),
    )
    assert len(read) == done.questions
    assert isinstance(read.features["image"], datasets.Image)
    row = read[0]
    assert row["image"].size == (128, 128)
    assert row["question"] in row["prompt"]
    assert json.loads(row["evidence"])["objects"]
    assert all(row["answer"] in row["options"] for row in read if row["kind"] in ("choice", "yes/no"))
    (file,) = (tmp_path / "out/data").glob("train-*.parquet")
    told = json.loads(pq.read_schema(file).metadata[b"huggingface"])["info"]["features"]
    kinds = set(re.findall(r'"_type": "(\w+)"', json.dumps(told)))
    assert kinds == {"Image", "Value", "Sequence"}, (
        "`List` is not known to datasets before 4.0, which reads nothing then"
    )


# webdataset leaves its files to the garbage collector
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_shards_are_read_by_webdataset(scenes: Path, tmp_path: Path) -> None:
    done = write_vqa(scenes, tmp_path / "out", "webdataset", per_scene=PER_SCENE, validation_share=0.0)
    shards = sorted(map(str, (tmp_path / "out").glob("train-*.tar")))
    samples = list(webdataset.WebDataset(shards, shardshuffle=False))
    gc.collect()
    assert len(samples) == done.pictures
    assert sum(len(json.loads(sample["json"])) for sample in samples) == done.questions
    assert all(Image.open(io.BytesIO(sample["jpg"])).size == (128, 128) for sample in samples)


@pytest.mark.parametrize(
    ("convention", "form"),
    [
        ("robopoint", r"\[\(0\.\d{3}, 0\.\d{3}\)\]"),
        ("roborefer", r"\[\(0\.\d{3}, 0\.\d{3}\)\]"),
        ("pixel", r"\(\d{1,3}, \d{1,3}\)"),
        ("thousand", r"\(\d{1,3}, \d{1,3}\)"),
        ("unit", r"\(0\.\d{3}, 0\.\d{3}\)"),
    ],
)
def test_points_in_the_convention_of_a_model(questions: list[Question], convention: str, form: str) -> None:
    points = [each for each in questions if each.family == "point_at_object"]
    assert points
    for each in points:
        words = word_question(each, convention, 128, 128)
        assert re.fullmatch(form, words.response)
        assert words.prompt.startswith(words.question)
        assert len(words.prompt) > len(words.question)
        x, y = (float(number) for number in re.findall(r"[\d.]+", words.response))
        unit = {"pixel": 128, "thousand": 1000}.get(convention, 1)
        assert (x / unit, y / unit) == pytest.approx(each.points[0], abs=1 / 128)


def test_the_same_input_gives_the_same_bytes(llava: Path, scenes: Path, tmp_path: Path) -> None:
    write_vqa(scenes, tmp_path / "again", per_scene=PER_SCENE, validation_share=0.0)
    for path in llava.rglob("*"):
        if path.is_file():
            assert path.read_bytes() == (tmp_path / "again" / path.relative_to(llava)).read_bytes()


def test_wrong_values_are_named(scenes: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="llava"):
        write_vqa(scenes, tmp_path / "out", "csv")
    with pytest.raises(UsageError, match="robopoint"):
        write_vqa(scenes, tmp_path / "out", points="polar")
    with pytest.raises(UsageError, match="give 1 or more"):
        write_vqa(scenes, tmp_path / "out", per_scene=0)
    with pytest.raises(UsageError, match="no scene there"):
        write_vqa(tmp_path, tmp_path / "out")
    assert not (tmp_path / "out").exists()
