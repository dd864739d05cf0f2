"""Writing of a twin in one format to disk: one folder for each format, written atomically."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path, PurePosixPath

from manitwin.assets.writers.exporter import Exported, TwinContent
from manitwin.assets.writers.format_notes import QUANTITIES, UNTOLD, FormatNotes
from manitwin.assets.writers.licenses import LICENSE_FILE, check_license, license_of, license_text
from manitwin.assets.writers.mass_properties import inertial_of
from manitwin.assets.writers.registry import exporter
from manitwin.errors import ExportError
from manitwin.formats.markdown import markdown_escaped
from manitwin.twin.record_values import Estimate
from manitwin.twin.store import atomic_folder

MAX_NAME = 255
"""Largest file name in bytes on ext4, APFS and NTFS."""

_FORBIDDEN = frozenset('<>:"|?*\\')  # Windows forbids these; separators never belong to a name here
README_FILE = "README.md"
JOINTS_LOCKED = (
    "its {count} joints: it is one rigid body as the twin stands; the formats mjcf, urdf, sdf, usd and usdz have links"
    " and joints."
)
"""README line for a format without joints when the twin has some."""


def export_twin(
    twin: TwinContent,
    format_name: str,
    out: str | Path,
    *,
    license_allow: Iterable[str] | None = None,
    on_locked: Callable[[str], object] = lambda name: None,
) -> Path:
    """Write a twin to ``out/<twin name>/<format>/`` with README.md and LICENSE.txt, and return the file to open.

    An earlier export there is replaced, and output is deterministic. ``on_locked`` is called with the format if the twin has
    joints and the files do not. Raises UsageError for an unknown format, and ExportError for a licence that is not allowed, a
    twin that the format cannot represent, or a folder that cannot be written.
    """
    check_license(twin.record, license_allow)
    exported = exporter(format_name)(twin)
    if twin.record.joints and not exported.joints:
        said = JOINTS_LOCKED.format(count=len(twin.record.joints))
        exported = replace(exported, cannot_say=(said, *exported.cannot_say))
        on_locked(format_name)
    texts = {README_FILE: readme(twin, format_name, exported), LICENSE_FILE: license_text(twin.record)}
    whole = replace(exported, files={**exported.files, **{name: text.encode() for name, text in texts.items()}})
    return write_exported(whole, Path(out) / safe_name(twin.name, one=True) / format_name)


def write_exported(exported: Exported, folder: Path) -> Path:
    """Write the files into a temporary folder, rename it to ``folder``, and return the path of ``main``.

    Raises ExportError for an unsafe file name, before anything is written, and if writing fails.
    """
    names = {name: PurePosixPath(safe_name(name)) for name in exported.files}
    if exported.main not in names:
        raise ExportError(f"{folder}: the file to open, {exported.main!r}, is not among those written")
    if len({name.casefold() for name in names}) < len(names):
        raise ExportError(f"{folder}: two file names differ in case only; not every file system keeps both")
    try:
        with atomic_folder(folder) as fresh:
            for name, data in sorted(exported.files.items()):
                place = fresh / names[name]
                place.parent.mkdir(parents=True, exist_ok=True)
                place.write_bytes(data)
    except OSError as error:
        raise ExportError(f"{folder}: not written ({error}); mend that and export again") from error
    return folder / names[exported.main]


def safe_name(name: str, *, one: bool = False) -> str:
    """Return a relative ``/``-separated name that stays in its folder (``one``: a single part), or raise ExportError."""
    parts = name.split("/")
    fine = len(parts) == 1 or not one
    fine = fine and all(
        part not in ("", ".", "..")
        and part == part.strip(" ")
        and part.isprintable()
        and not _FORBIDDEN & set(part)
        and len(part.encode()) <= MAX_NAME
        for part in parts
    )
    if not fine:
        raise ExportError(f"{name!r}: no name for a file below the export's folder; nothing is written")
    return name


def readme(twin: TwinContent, format_name: str, exported: Exported) -> str:
    """Return the README of a twin in one format. Raises ExportError like ``inertial_of``."""
    notes = exported.notes or FormatNotes.of(format_name)
    record = twin.record
    caption = markdown_escaped(record.name or "An object." if record.language is None else record.language.caption)
    lines = [
        f"# {twin.name} for {notes.title}",
        "",
        f"{caption} Open `{exported.main}`. SI units; lengths are in metres in the files themselves, nothing is scaled.",
        "",
        *_quantity_lines(twin, notes),
        "",
        "## What these files cannot say",
        "",
        *[f"- {line}" for line in exported.cannot_say or (_no_omissions_line(notes),)],
        "",
        *_how_to_load(twin, notes, exported),
        "## Licence",
        "",
        f"{markdown_escaped(license_of(record))}; "
        f"attribution: {markdown_escaped(record.source.attribution or '') or 'none known'}. "
        f"See [{LICENSE_FILE}]({LICENSE_FILE}); it goes wherever these files go.",
    ]
    return "\n".join(lines) + "\n"


def _no_omissions_line(notes: FormatNotes) -> str:
    told = UNTOLD not in notes.says.values()
    return "nothing that the twin knows of its physics." if told else f"{UNTOLD}."


def _quantity_lines(twin: TwinContent, notes: FormatNotes) -> list[str]:
    physical, inertial = twin.physical, inertial_of(twin)
    moments = ", ".join(f"{moment:.4g}" for moment in sorted(inertial.principal_moments_kg_m2))
    sizes = " x ".join(f"{side:.4g}" for side in physical.extents_m)
    values = {
        "mass": f"{_estimate(physical.mass_kg)} kg",
        "centre of mass": ", ".join(f"{x:.4g}" for x in inertial.center_of_mass_m) + " m",
        "inertia": f"principal moments {moments} kg m²",
        "friction": f"static {_estimate(physical.friction_static)}, dynamic {_estimate(physical.friction_dynamic)}",
        "restitution": _estimate(physical.restitution),
        "hulls": f"{len(twin.hulls)} convex ones",
        "frame": f"{sizes} m along x, y, z of the object frame",
    }
    rows = [f"| {quantity} | {values[quantity]} | {notes.where(quantity)} |" for quantity in QUANTITIES]
    return ["| | of the twin | in these files |", "|---|---|---|", *rows]


def _estimate(estimate: Estimate) -> str:
    return f"{estimate.value:.4g} ({estimate.low:.4g} to {estimate.high:.4g}, {markdown_escaped(estimate.source)})"


def _how_to_load(twin: TwinContent, notes: FormatNotes, exported: Exported) -> list[str]:
    if not notes.load:
        return []
    words = {
        "{main}": exported.main,
        "{folder}": PurePosixPath(exported.main).parent.name,
        "{name}": twin.name,
        "{NAME}": twin.name.upper(),
    }
    lines = ["## How to load it", ""]
    for simulator, code in notes.load.items():
        language = "bash" if code.startswith("export ") else "python"
        filled = code
        for word, value in words.items():
            filled = filled.replace(word, value)
        lines += [f"{simulator}:", "", f"```{language}", filled, "```", ""]
    return lines
