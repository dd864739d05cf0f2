"""README.md of an export: what its files say, what they cannot, how to load them, and under which licence they are."""

from __future__ import annotations

from pathlib import PurePosixPath

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.exporter import Exported
from manitwin.assets.writers.format_notes import QUANTITIES, UNTOLD, FormatNotes
from manitwin.assets.writers.inertial import inertial_of
from manitwin.assets.writers.licenses import LICENSE_FILE, license_of
from manitwin.formats.markdown import markdown_escaped
from manitwin.twin.record import Estimate

README_FILE = "README.md"


def readme(twin: TwinContent, format_name: str, exported: Exported) -> str:
    """Return the README of a twin in one format. Raises ExportError as ``inertial_of``."""
    notes = exported.notes or FormatNotes.of(format_name)
    record = twin.record
    caption = markdown_escaped(record.name or "An object." if record.language is None else record.language.caption)
    lines = [
        f"# {twin.name} for {notes.title}",
        "",
        f"{caption} Open `{exported.main}`. SI units; lengths are in metres in the files themselves, nothing is scaled.",
        "",
        *_what_is_said(twin, notes),
        "",
        "## What these files cannot say",
        "",
        *[f"- {line}" for line in exported.cannot_say or (_nothing_left_out(notes),)],
        "",
        *_how_to_load(twin, notes, exported),
        "## Licence",
        "",
        f"{markdown_escaped(license_of(record))}; "
        f"attribution: {markdown_escaped(record.source.attribution or '') or 'none known'}. "
        f"See [{LICENSE_FILE}]({LICENSE_FILE}); it goes wherever these files go.",
    ]
    return "\n".join(lines) + "\n"


def _nothing_left_out(notes: FormatNotes) -> str:
    told = UNTOLD not in notes.says.values()
    return "nothing that the twin knows of its physics." if told else f"{UNTOLD}."


def _what_is_said(twin: TwinContent, notes: FormatNotes) -> list[str]:
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
