"""Recorded answers give the same twins: byte for byte when replayed again, and all but who answered as they were recorded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manitwin.api import build
from manitwin.config import BuildConfig, ServicesConfig
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.twin.store import read_record

SAMPLES = Path(__file__).resolve().parents[1] / "samples"

pytestmark = pytest.mark.slow  # three whole builds


def built(out: Path, **settings: Any) -> Path:
    config = BuildConfig(**settings)
    result = build(SAMPLES / "mug.glb", out, name="mug", jobs=1, quick=True, config=config).results[0]
    assert result.status == "accepted" and result.folder is not None
    return result.folder


def files_of(twin: Path) -> dict[str, bytes]:
    """All files but the one that says how long each stage took."""
    files = {str(path.relative_to(twin)): path for path in sorted(twin.rglob("*")) if path.is_file()}
    return {name: path.read_bytes() for name, path in files.items() if name != "run.json"}


def test_replayed_answers_give_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MANITWIN_VLM_KEY", "rehearsal-key")
    record = tmp_path / "answers.jsonl"
    with FakeServer(FakeOpenAi(key="rehearsal-key")) as server:
        services = ServicesConfig(cache=False, record=record)
        first = built(tmp_path / "recorded", annotator=f"openai:eyes@{server.url}/v1", services=services)
    lines = record.read_bytes().splitlines(keepends=True)
    record.write_bytes(b"".join(reversed(lines)))  # votes are answered at the same time: their order says nothing
    again, once_more = (built(tmp_path / name, annotator=f"replay:{record}") for name in ("again", "once_more"))
    assert files_of(again) == files_of(once_more)
    before, after = files_of(first), files_of(again)
    own = {name for name in before if before[name] != after[name]}
    assert before.keys() == after.keys() and own == {"twin.json"}
    differs = {"revision", "provenance", "files"}
    assert read_record(first).model_dump(exclude=differs) == read_record(again).model_dump(exclude=differs)
