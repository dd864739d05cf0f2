"""JSON, TOML and CSV that others wrote are parsed in one module each."""

from __future__ import annotations

import re
from pathlib import Path

import manitwin

PACKAGE = Path(manitwin.__file__).parent
JSON_ELSEWHERE = {
    "assets/writers/maniskill_load.py": "goes into an export and has no package beside it",
    "assets/writers/format_notes.py": "shows such a line in a README",
    "formats/glb.py": "unpacks what pack_glb made in this process",
    "models/services/bodies.py": "reads the text that json.dumps made a line above",
    "models/generators/rodin.py": "takes apart the job's id that it made itself",
    "models/vlm/structured.py": "finds an answer's JSON among other words, and refuses the answer where there is none",
    "models/fakes/": "stand-ins of servers, on this machine, for rehearsals",
    "render/device.py": "what a process told its child in an environment variable",
    "scenes/run_settings.py": "of settings that json.dumps made in the same line",
    "engine/": "ledgers and results of stages, which have readers of their own",
    "episodes/": "episodes and their records, which have readers of their own",
    "scenes/": "scenes and their records, which have readers of their own",
    "dataset/": "cards, tables and receipts, which have readers of their own",
    "models/generators/run.py": "lines of a generator's program, each read and refused there",
    "formats/meshes/gltf.py": "glTF's documents, in the process that meshes are read in",
}
"""Where JSON is parsed beside ``formats/json_file.py``, and why that is none of others, or none of a person's files."""


def parsing(pattern: str) -> list[str]:
    parses = re.compile(pattern)
    files = (path for path in sorted(PACKAGE.rglob("*.py")) if parses.search(path.read_text(encoding="utf-8")))
    return [path.relative_to(PACKAGE).as_posix() for path in files]


def test_toml_and_csv_are_parsed_in_one_module_each() -> None:
    assert parsing(r"tomllib|\btoml\.load") == ["formats/toml_file.py"]
    assert parsing(r"csv\.(reader|DictReader)|read_csv\(.*pyarrow") == ["formats/csv_file.py"]


def test_json_of_twins_assets_settings_and_answers_is_parsed_in_one_module() -> None:
    found = parsing(r"json\.loads?\(|model_validate_json|JSONDecoder|orjson")
    others = [path for path in found if not any(path.startswith(known) for known in JSON_ELSEWHERE)]
    assert others == ["formats/json_file.py"]


def test_nothing_that_reads_files_of_others_opens_them_by_itself() -> None:
    """Pipes are waited for, devices never end, and links lead out: ``bounded_file`` opens regular files alone."""
    opens = re.compile(r"\.read_bytes\(\)|\.read_text\(|\.open\(\"rb?\"\)|[^.\w]open\(")
    rooms = (
        "assets/readers",
        "assets/audit",
        "assets/importers",
        "assets/read.py",
        "robots",
        "models/vlm",
        "pipeline/manifest.py",
        "pipeline/manifest_item.py",
    )
    found = [
        path.relative_to(PACKAGE).as_posix()
        for room in rooms
        for path in ([PACKAGE / room] if room.endswith(".py") else sorted((PACKAGE / room).rglob("*.py")))
        if opens.search(path.read_text(encoding="utf-8"))
    ]
    assert found == [], "read with formats/bounded_file.py"
