"""What ``datasets`` and the hub's library make of the card, and that its numbers and examples are true."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from made_twins import CORNERS_M

from manitwin.dataset.publish.card import size, size_category
from manitwin.dataset.publish.publish import publish_dataset
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.link_records import FACE_LINKS
from manitwin.twin.part_records import FACE_PARTS
from manitwin.twin.shape_file import SHAPE
from manitwin.twin.store import RECORD, RUN, read_record


def run_offline(code: str, folder: Path, scratch: Path) -> Any:
    """Run code in a process of its own, without network and with warnings as errors; returns what it prints as JSON."""
    environment = {
        **os.environ,
        "HF_HUB_OFFLINE": "1",
        "HF_HOME": str(scratch / "hf"),
        "HF_DATASETS_DISABLE_PROGRESS_BARS": "1",
    }
    head = "import warnings; warnings.simplefilter('error')\nimport datasets\n"
    done = subprocess.run(
        [sys.executable, "-c", head + code, str(folder)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def published_records(dataset: Path) -> dict[str, Any]:
    root = DatasetRoot(dataset)
    return {i: read_record(dataset / twin_name(i)) for i in root.twin_ids() if i[0] in "ab"}


def test_datasets_loads_every_table_offline_and_agrees_with_the_twins(
    dataset: Path, published: Path, tmp_path: Path
) -> None:
    code = """
import json, sys
rows = {"default": datasets.load_dataset(sys.argv[1], split="train").to_list()}
for name in ("twins", "points", "grasps", "placements", "shards"):
    rows[name] = datasets.load_dataset(sys.argv[1], name, split="train").to_list()
print(json.dumps(rows))
"""
    rows = run_offline(code, published, tmp_path)
    records = published_records(dataset)
    assert rows["default"] == rows["twins"]
    assert [row["twin_id"] for row in rows["twins"]] == sorted(records)
    for row in rows["twins"]:
        record = records[row["twin_id"]]
        assert (row["mass_kg"], row["verified"]) == (record.physical.mass_kg.value, record.grasps.verified)
        assert (row["license"], row["attribution"]) == (record.source.license, record.source.attribution)
        assert row["longest_m"] == pytest.approx(2 * max(CORNERS_M))
        assert row["twin_id"] in shard_members(published / row["shard"])
    assert sum(row["verified"] for row in rows["grasps"]) == sum(r.grasps.verified for r in records.values())
    assert len(rows["points"]) == 2 * len(records) and len(rows["placements"]) == len(records)
    assert {row["shard"]: row["bytes"] for row in rows["shards"]} == {
        path.relative_to(published).as_posix(): path.stat().st_size for path in published.rglob("*.tar")
    }


def shard_members(path: Path) -> set[str]:
    import tarfile

    with tarfile.open(path) as tar:
        return {name.partition(".")[0] for name in tar.getnames()}


def test_examples_of_the_card_run(published: Path, tmp_path: Path) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(published, folder)
    blocks = re.findall(r"```python\n(.*?)```", (folder / "README.md").read_text(), re.DOTALL)
    assert len(blocks) == 3
    # the small twins have at most 3 verified grasps; webdataset leaves its files to the garbage collector
    code = "\n".join(blocks).replace('["verified"] >= 20', '["verified"] >= 2')
    tail = """
import json
print(json.dumps({"wanted": len(wanted), "grasps": len(grasps), "hulls": len(hulls.geometry), "extents": visual.extents.tolist(),
                  "twin": twin.record.twin_id}))
"""
    found = run_offline(
        f"warnings.simplefilter('ignore', ResourceWarning)\nimport sys; PATH = sys.argv[1]\n{code}{tail}",
        folder,
        tmp_path,
    )
    assert (found["wanted"], found["grasps"], found["hulls"]) == (1, 24, 2), "one 'salad bowl', one 'Salad bowl'"
    x, y, z = (2 * corner for corner in CORNERS_M)
    assert found["extents"] == pytest.approx([x, z, y]), "glTF is Y-up"
    assert found["twin"] == "b100000000000000"


def test_front_matter_is_what_the_hub_reads(published: Path) -> None:
    from huggingface_hub import DatasetCard

    data = DatasetCard.load(published / "README.md").data.to_dict()
    assert data["pretty_name"] == "small-set"
    assert (data["license"], data["license_link"]) == ("other", "LICENSES.md")
    assert (data["size_categories"], data["task_categories"]) == (["n<1K"], ["robotics"])
    default = [config["config_name"] for config in data["configs"] if config.get("default")]
    assert default == ["twins"] and len(data["configs"]) == 5


def test_name_with_quotes_and_markup_stays_a_name(dataset: Path, tmp_path: Path) -> None:
    from huggingface_hub import DatasetCard

    publish_dataset(dataset, tmp_path / "out", name='Bob\'s "mugs": <b>1</b> | é')
    text = (tmp_path / "out" / "README.md").read_text()
    assert DatasetCard(text).data.pretty_name == 'Bob\'s "mugs": <b>1</b> | é'
    assert "<b>" not in text.split("---", 2)[2]


def test_totals_are_those_of_the_published_twins(dataset: Path, published: Path) -> None:
    text = (published / "README.md").read_text()
    records = published_records(dataset).values()
    simulated, verified = (sum(getattr(r.grasps, key) for r in records) for key in ("simulated", "verified"))
    assert "| twins | 6 |" in text and f"| grasps tried in physics | {simulated} |" in text
    assert f"| grasps verified | {verified} ({verified / simulated:.1%}) |" in text
    assert "| mug | 4 | 6 |" in text, "0 + 1 + 2 + 3 verified"
    assert "| CC0-1.0 | 1 | 0 |" in text and "unknown" not in text
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert pictures and all((published / picture).is_file() for picture in pictures)


def test_each_part_of_a_twin_and_what_retired_means_are_told(published: Path) -> None:
    text = (published / "README.md").read_text()
    parts = (RECORD, "visual.glb", "collision.zip", FACE_PARTS, FACE_LINKS, SHAPE, "grasps.parquet", "card.png", RUN)
    assert [part for part in parts if f"| `{part}` |" not in text] == []
    assert "`retired`" in text


@pytest.mark.parametrize(("count", "word"), [(0, "n<1K"), (999, "n<1K"), (1000, "1K<n<10K"), (100_000, "100K<n<1M")])
def test_size_category_is_the_hubs(count: int, word: str) -> None:
    assert size_category(count) == word


def test_sizes_read_as_the_hub_counts() -> None:
    assert [size(n) for n in (0, 999, 1500, 76_600_000, 3 * 10**11)] == ["0 B", "999 B", "1.5 kB", "76.6 MB", "300 GB"]
