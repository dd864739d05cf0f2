"""Mutations of files: of the structure that a format has (JSON, XML, lines of text, archives, GLB), and of plain bytes.

``mutated(name, content, others, rng)`` chooses by the file's name. The same generator gives the same bytes.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable, Sequence
from random import Random

from fuzz_containers import mutate_glb, mutate_ply, mutate_png
from fuzz_documents import mutate_json, mutate_lines_of_json, mutate_xml
from fuzz_plain import MOST_BYTES, mutate_bytes, mutate_text, spliced

Mutation = Callable[[bytes, Random], bytes]


def mutated(name: str, content: bytes, others: Sequence[bytes], rng: Random) -> bytes:
    """Return the content of a file with one to four mutations; ``others`` are contents to splice with."""
    structured = _structured(name, content)
    for _ in range(1 + min(3, int(rng.expovariate(1.2)))):
        if structured is not None and rng.random() < 0.7:
            content = structured(content, rng)
        elif others and rng.random() < 0.1:
            content = spliced(content, rng.choice(others), rng)
        else:
            content = mutate_bytes(content, rng)
        if len(content) > MOST_BYTES:
            break
    return content


def _structured(name: str, content: bytes) -> Mutation | None:
    suffix = name.rpartition(".")[2].lower()
    if suffix == "ply":
        return mutate_ply
    if suffix == "stl":
        return mutate_text if content[:5] == b"solid" else None
    return _BY_SUFFIX.get(suffix)


def mutate_archive(content: bytes, rng: Random) -> bytes:
    """Change one file of a ZIP archive, its name, or the number of its files."""
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            files = [(entry.filename, archive.read(entry)) for entry in archive.infolist()]
    except Exception:  # an archive that an earlier mutation has broken
        return mutate_bytes(content, rng)
    if not files:
        return mutate_bytes(content, rng)
    at = rng.randrange(len(files))
    name, data = files[at]
    kind = rng.randrange(6)
    if kind <= 2:
        files[at] = (name, mutated(name, data, (), rng))
    elif kind == 3:
        files[at] = (
            rng.choice(("../" + name, "/" + name, "", "x" * 300, name.upper(), "a/b/" + name, name + "\0x")),
            data,
        )
    elif kind == 4:
        del files[at]
    else:
        files[at:at] = [(f"{i}{name}", data[:100]) for i in range(rng.choice((1, 500)))]
    buffer = io.BytesIO()
    method = rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in files:
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data, method)
    return buffer.getvalue()


_BY_SUFFIX: dict[str, Mutation] = {
    **dict.fromkeys(("json", "gltf"), mutate_json),
    "jsonl": mutate_lines_of_json,
    **dict.fromkeys(("xml", "urdf", "mjcf", "sdf", "dae", "config"), mutate_xml),
    **dict.fromkeys(("toml", "csv", "obj", "mtl", "usda", "pbtxt", "txt", "md", "srdf"), mutate_text),
    **dict.fromkeys(("usdz", "zip", "npz"), mutate_archive),
    "glb": mutate_glb,
    "png": mutate_png,
}
