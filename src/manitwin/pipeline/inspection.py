"""Inspection of inputs before a build, in a separate process with limits on time and memory.

The functions named ``read_*`` run in that process; the driver itself opens no input. This module has few imports, because the
process imports it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from manitwin.errors import InputChanged, Rejected, UsageError
from manitwin.formats.bounded_file import open_regular, read_bytes
from manitwin.formats.isolated import Limits, ProcessCrashed, iterate_isolated, run_isolated
from manitwin.formats.sniff import HEIC_NOT_READ, NOT_READ, image_format, sniff
from manitwin.formats.source_files import named_files

if TYPE_CHECKING:
    from manitwin.engine.recipe import Identity, Recipe
    from manitwin.pipeline.item import Item

LIMITS = Limits(seconds=10.0, memory_bytes=4 << 30)
"""Limits for inspecting one file; a mesh of 500 MB takes 2 s, and memory for its text."""
MAX_NAMES = 10_000
MAX_RECORD_BYTES = 64 << 20
_THIS = __name__
_BY_SUFFIX = {
    **NOT_READ,
    **dict.fromkeys((".csv", ".jsonl"), "a manifest is read only if its own path is given"),
    ".mtl": "a material library that no mesh names",
    ".bin": "a buffer that no mesh names",
}


WHOLE = Limits(seconds=300.0, memory_bytes=4 << 30)
"""Limits for reading a whole input once for its digest: 4 GiB from a disk with 15 MB/s."""


class NotInspected(Exception):
    """An input that could not be inspected at all or within the limits; the message is the reason for ignoring it."""


def names_of(meshes: Iterable[Path]) -> Iterator[list[str] | NotInspected]:
    """Yield for each mesh the names of other files that it references, or why they are unknown."""
    return (_found(answer) for _, answer in iterate_isolated(f"{_THIS}:read_names", meshes, LIMITS))


def why_no_inputs(files: Collection[Path]) -> list[str | None]:
    """Return for each file without an input's suffix why it is not an input; None for an image with another suffix."""
    known = {file: _BY_SUFFIX.get(file.suffix.lower()) for file in files}
    unknown = [file for file, reason in known.items() if reason is None]
    for file, answer in iterate_isolated(f"{_THIS}:read_whether_image", unknown, LIMITS):
        found = _found(answer)
        known[file] = str(found) if isinstance(found, NotInspected) else found
    return [known[file] for file in files]


def are_twins(records: Iterable[Path]) -> Iterator[bool]:
    """Yield for each file named twin.json whether it is a twin's record."""
    for _, answer in iterate_isolated(f"{_THIS}:read_whether_twin", records, LIMITS):
        yield _found(answer) is True  # unreadable files are listed and reported elsewhere


def are_imported(records: Iterable[Path]) -> Iterator[str | None]:
    """Yield for each import.json why the asset cannot be used; None if it can."""
    for _, answer in iterate_isolated(f"{_THIS}:read_import", records, LIMITS):
        found = _found(answer)
        yield str(found) if isinstance(found, NotInspected) else None


def inspect_import(record: Path) -> tuple[str, str | None, str | None]:
    """Return the name, licence and attribution of an imported asset. Raises UsageError."""
    found = run_inspection("read_import", record)
    if isinstance(found, NotInspected):
        raise UsageError(f"{record}: {found}")
    name, license_, attribution = found
    return name, license_, attribution


def is_image(file: Path) -> bool:
    """Return whether a file contains an image; False if it cannot be inspected."""
    return run_inspection("read_kind", file) == "image"


def inspect_identity(recipe: Recipe, item: Item, frame: int | None) -> tuple[Identity, Rejected | None] | NotInspected:
    """Return an input's identity, and a rejection if an image's header is invalid; ``frame`` selects a frame of an animation."""
    found: tuple[Identity, Rejected | None] | NotInspected
    found = run_inspection("read_identity", recipe, item, frame, limits=WHOLE)
    return found


def run_inspection(function: str, *arguments: Any, limits: Limits = LIMITS) -> Any:
    """Run a function of this module in the limited process and return its result; NotInspected if it fails."""
    try:
        return run_isolated(f"{_THIS}:{function}", *arguments, limits=limits)
    except (Rejected, UsageError, InputChanged, NotInspected, ProcessCrashed, MemoryError) as error:
        return _found((False, error), limits)


def _found(answer: tuple[bool, Any], limits: Limits = LIMITS) -> Any:
    returned, value = answer
    if returned:
        return value
    if isinstance(value, ProcessCrashed):
        seconds = f"it takes longer than {limits.seconds:g} s, or crashes the process"
        return NotInspected(f"could not be inspected ({seconds}); export it again, or leave it out")
    if isinstance(value, MemoryError):
        memory = f"it takes more than {limits.memory_bytes >> 30} GiB of memory"
        return NotInspected(f"could not be inspected ({memory}); make it smaller, or leave it out")
    if isinstance(value, Rejected):
        return NotInspected(value.detail)
    if isinstance(value, NotInspected | UsageError | InputChanged):
        return NotInspected(str(value))
    raise value


def read_identity(recipe: Recipe, item: Item, frame: int | None) -> tuple[Identity, Rejected | None]:
    """Return an input's identity, and a rejection if an image's header is invalid. Raises InputError; InputChanged for a missing
    file.
    """
    from manitwin.formats.image_file import check_header  # 0.1 CPU-seconds to import

    identity = recipe.identify(item)
    try:
        for file in item.files if identity.kind in ("image", "photos") else ():
            check_header(Path(file), frame=frame)
    except Rejected as answer:
        return identity, answer
    return identity, None


def read_names(mesh: Path) -> list[str]:
    """Return the names of other files that a mesh references; empty if it is unreadable, which its reader will report."""
    try:
        return list(islice(named_files(mesh), MAX_NAMES))
    except OSError:
        return []


def read_whether_image(file: Path) -> str | None:
    """Return None for an image with another suffix, else why the file is not an input."""
    with open_regular(file, NotInspected) as stream:
        try:
            found = image_format(stream.read(64))
        except OSError as error:
            raise NotInspected(f"cannot be read ({error.strerror or error})") from error
    if found == "heif":
        return HEIC_NOT_READ
    return None if found is not None else "not an image or a mesh"


def read_whether_twin(record: Path) -> bool:
    """Return whether a file is a twin's record."""
    return b'"twin_id"' in read_bytes(record, MAX_RECORD_BYTES, NotInspected)


def read_import(record: Path) -> tuple[str, str | None, str | None]:
    """Return the name, licence and attribution of an imported asset. Raises UsageError."""
    from manitwin.twin.import_record import read_import_record  # 0.5 CPU-seconds to import

    given = read_import_record(record)
    return given.prior_key, given.license, given.attribution


def read_kind(file: Path) -> str:
    """Return the kind of an input from its content. Raises InputError."""
    return sniff(file).kind
