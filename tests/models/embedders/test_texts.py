"""Embeddings of texts by a served model, as the API's contract says, and what is no such answer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.config import ServicesConfig
from manitwin.errors import AccessDenied, BadReply, ConfigError, UsageError
from manitwin.models.embedders.clip_tokens import ClipTokens
from manitwin.models.embedders.texts import BATCH, ServedTexts, text_embedder
from manitwin.models.fakes.catalog import serving
from manitwin.models.fakes.embeddings import vector_of
from manitwin.models.fakes.server import FakeServer, Response
from scripted_service import Script
from tiny_clip import text_vector, write_tiny_clip

SERVICES = ServicesConfig(retries=0, timeout_s=20)


def test_texts_come_back_in_their_order_however_many() -> None:
    texts = [f"mug number {number}" for number in range(BATCH + 5)]
    with serving("openai") as server:
        vectors = ServedTexts("small", f"{server.url}/v1", server.key, SERVICES).embed(texts)
        with pytest.raises(AccessDenied):
            ServedTexts("small", f"{server.url}/v1", "another-key", SERVICES).embed(texts[:1])
        with pytest.raises(BadReply):
            ServedTexts("small", f"{server.url}/v1", server.key, SERVICES).embed([""])
    assert vectors == pytest.approx(np.array([vector_of(text) for text in texts]), abs=1e-6)


@pytest.mark.parametrize(
    "data",
    [
        None,
        [{"index": 0, "embedding": [1.0]}],
        [{"index": 0, "embedding": [1.0]}, {"index": 0, "embedding": [1.0]}],
        [{"index": 0, "embedding": [1.0]}, {"index": 1, "embedding": []}],
        [{"index": 0, "embedding": [1.0]}, {"index": 1, "embedding": [0.0]}],
        [{"index": 0, "embedding": [1.0]}, {"index": 1, "embedding": ["1"]}],
        [{"index": 0, "embedding": [1.0]}, {"index": 1, "embedding": [1.0, 2.0]}],
    ],
    ids=["none", "too few", "twice", "empty", "zero", "a text", "two lengths"],
)
def test_what_is_no_vector_for_each_text_is_refused(data: Any) -> None:
    with FakeServer(Script(Response(200, {"data": data}))) as server, pytest.raises(BadReply):
        ServedTexts("small", server.url, None, SERVICES).embed(["a mug", "a pan"])


@pytest.mark.parametrize("spec", ["openai", "openai:", "anthropic:small", "small"])
def test_a_spec_without_a_model_is_refused(spec: str) -> None:
    with pytest.raises(ConfigError, match="openai:MODEL"):
        text_embedder(spec, SERVICES)


def test_a_key_is_asked_for_as_that_of_a_chat_model(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    with pytest.raises(ConfigError, match="OPENAI_API_KEY"):
        text_embedder("openai:text-embedding-3-small", SERVICES)
    local = text_embedder("openai:small@http://127.0.0.1:9/v1", SERVICES)
    assert local.identity == "http://127.0.0.1:9/v1 small"


def test_a_clips_folder_embeds_on_this_machine_and_is_known_by_its_content(tmp_path: Path) -> None:
    weights = write_tiny_clip(tmp_path / "one")
    write_tiny_clip(tmp_path / "same")
    write_tiny_clip(tmp_path / "other", seed=1)
    embedder = text_embedder(f"clip:{tmp_path / 'one'}", SERVICES)
    vectors = embedder.embed(["mug", "red mug"])
    for text, vector in zip(("mug", "red mug"), vectors, strict=True):
        expected = text_vector(weights, ClipTokens.of_folder(tmp_path / "one").encode(text))
        assert vector == pytest.approx(expected / np.linalg.norm(expected), abs=1e-4)
    assert embedder.embed([]).size == 0 and vectors.dtype == np.float32
    same, other = (text_embedder(f"clip:{tmp_path / name}", SERVICES) for name in ("same", "other"))
    assert embedder.identity == same.identity != other.identity
    for spec, error in ((f"clip:{tmp_path}", UsageError), ("clip:", ConfigError)):
        with pytest.raises(error):
            text_embedder(spec, SERVICES)
