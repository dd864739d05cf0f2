"""File formats of questions: JSON of LLaVA and ShareGPT, Parquet for Hugging Face datasets, WebDataset shards."""

from __future__ import annotations

import io
import json
import tarfile
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.scenes.perception.output import Output
from manitwin.scenes.vqa.question import Question
from manitwin.scenes.vqa.wording import word_question
from manitwin.twin.store import canonical_json

SHARD_PICTURES = 1000
PARQUET_ROWS = 2000
"""Number of questions in one Parquet file, which embeds their pictures."""


@dataclass(frozen=True)
class Pictures:
    """The pictures by name as JPEG, read on access, and the ``size_px`` (width, height) of each."""

    jpeg: Callable[[str], bytes]
    size_px: Mapping[str, tuple[int, int]]


def write_llava(questions: Sequence[Question], pictures: Pictures, convention: str, out: Output) -> None:
    """Write ``<split>.json`` in the format that readers of LLaVA and ShareGPT accept, and ``images/``."""
    for name in sorted({question.picture for question in questions}):
        out.write_bytes(f"images/{name}", pictures.jpeg(name))
    for split, of_split in _by_split(questions).items():
        out.write_json(f"{split}.json", [_conversation(each, pictures, convention) for each in of_split])


def _conversation(question: Question, pictures: Pictures, convention: str) -> dict[str, Any]:
    words = word_question(question, convention, *pictures.size_px[question.picture])
    return {
        "id": question.question_id,
        "image": question.picture,
        "conversations": [
            {"from": "human", "value": f"<image>\n{words.prompt}"},
            {"from": "gpt", "value": words.response},
        ],
        "category": question.category,
        "family": question.family,
        "answer": words.answer,
    }


_FEATURES: dict[str, tuple[pa.DataType, Any]] = {
    "image": (pa.struct([("bytes", pa.binary()), ("path", pa.string())]), {"_type": "Image"}),
    **{
        name: (pa.string(), {"dtype": "string", "_type": "Value"})
        for name in (
            "question_id", "scene_id", "camera", "category", "family", "kind", "question", "prompt", "answer", "response",
            "evidence",
        )
    },
    "options": (pa.list_(pa.string()), {"feature": {"dtype": "string", "_type": "Value"}, "_type": "Sequence"}),
    "points": (
        pa.list_(pa.list_(pa.float64())),
        {"feature": {"feature": {"dtype": "float64", "_type": "Value"}, "_type": "Sequence"}, "_type": "Sequence"},
    ),
    "boxes": (
        pa.list_(pa.list_(pa.float64())),
        {"feature": {"feature": {"dtype": "float64", "_type": "Value"}, "_type": "Sequence"}, "_type": "Sequence"},
    ),
}  # fmt: skip


def write_parquet(questions: Sequence[Question], pictures: Pictures, convention: str, out: Output) -> None:
    """Write ``data/<split>-N-of-M.parquet`` with embedded pictures, and with the features of ``datasets`` in the schema."""
    told = {"info": {"features": {name: feature for name, (_, feature) in _FEATURES.items()}}}
    schema = pa.schema([(name, kind) for name, (kind, _) in _FEATURES.items()])
    schema = schema.with_metadata({"huggingface": json.dumps(told)})
    for split, of_split in _by_split(questions).items():
        files = [of_split[start : start + PARQUET_ROWS] for start in range(0, len(of_split), PARQUET_ROWS)]
        for number, rows in enumerate(files):
            table = pa.Table.from_pylist([_row(each, pictures, convention) for each in rows], schema)
            stream = io.BytesIO()
            pq.write_table(table, stream, compression="zstd", row_group_size=100)
            out.write_bytes(f"data/{split}-{number:05d}-of-{len(files):05d}.parquet", stream.getvalue())


def _row(question: Question, pictures: Pictures, convention: str) -> dict[str, Any]:
    words = word_question(question, convention, *pictures.size_px[question.picture])
    return {
        **{name: getattr(question, name) for name in ("question_id", "scene_id", "camera", "category", "family", "kind")},
        "image": {"bytes": pictures.jpeg(question.picture), "path": question.picture},
        "question": words.question, "prompt": words.prompt, "answer": words.answer, "response": words.response,
        "evidence": canonical_json(question.evidence), "options": words.options,
        "points": [list(point) for point in question.points], "boxes": [list(box) for box in question.boxes],
    }  # fmt: skip


def write_webdataset(questions: Sequence[Question], pictures: Pictures, convention: str, out: Output) -> None:
    """Write ``<split>-NNNNNN.tar`` with ``<key>.jpg`` and ``<key>.json``, the list of its questions, for each picture."""
    for split, of_split in _by_split(questions).items():
        by_picture: dict[str, list[Question]] = defaultdict(list)
        for question in of_split:
            by_picture[question.picture].append(question)
        names = sorted(by_picture)
        for number, start in enumerate(range(0, len(names), SHARD_PICTURES)):
            stream = io.BytesIO()
            with tarfile.open(fileobj=stream, mode="w", format=tarfile.USTAR_FORMAT) as shard:
                for name in names[start : start + SHARD_PICTURES]:
                    key = name.removesuffix(".jpg")
                    rows = [{k: v for k, v in _row(each, pictures, convention).items() if k != "image"}
                            for each in by_picture[name]]  # fmt: skip
                    _add(shard, f"{key}.jpg", pictures.jpeg(name))
                    _add(shard, f"{key}.json", canonical_json(rows).encode())
            out.write_bytes(f"{split}-{number:06d}.tar", stream.getvalue())


def _add(shard: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size = len(content)
    shard.addfile(member, io.BytesIO(content))


def _by_split(questions: Sequence[Question]) -> dict[str, list[Question]]:
    found: dict[str, list[Question]] = defaultdict(list)
    for question in questions:
        found[question.split].append(question)
    return dict(sorted(found.items()))


FORMATS: Mapping[str, Callable[[Sequence[Question], Pictures, str, Output], None]] = {
    "llava": write_llava,
    "parquet": write_parquet,
    "webdataset": write_webdataset,
}
"""The writers by the name of their format."""
