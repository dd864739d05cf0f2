"""Licences of exports: check against an allow-list, and the texts that state licence, source and attribution."""

from __future__ import annotations

from collections.abc import Iterable

from manitwin.errors import ExportError, UsageError
from manitwin.formats.markdown import one_line
from manitwin.twin.record import TwinRecord

LICENSE_FILE = "LICENSE.txt"
UNKNOWN = "unknown"


def license_of(record: TwinRecord) -> str:
    """Return the licence of a twin's source: an SPDX identifier, or ``unknown``."""
    return one_line(record.source.license) or UNKNOWN


def allowed_licenses(names: Iterable[str] | None) -> frozenset[str] | None:
    """Return the allowed licences in lower case, or None without a list, which allows all.

    Raises UsageError for a list that names no licence.
    """
    if names is None:
        return None
    named = frozenset(name.strip().lower() for name in names if name.strip())
    if not named:
        raise UsageError("--license-allow names no licence; give SPDX identifiers by commas, such as CC-BY-4.0,CC0-1.0")
    return named


def check_license(record: TwinRecord, allow: Iterable[str] | None) -> None:
    """Raise ExportError if a list of licences is given and the twin's licence is not in it.

    Identifiers are compared without regard to case (SPDX specification 2.3, annex D.2); an expression such as
    ``MIT OR CC0-1.0`` is compared as a whole. ``unknown`` is exported only if the list names it.
    """
    allowed = allowed_licenses(allow)
    licence = license_of(record)
    if allowed is not None and licence.lower() not in allowed:
        hint = "say it with --license when building" if licence.lower() == UNKNOWN else f"name {licence} to allow it"
        raise ExportError(
            f"{record.twin_id}: its licence is {licence}, which --license-allow does not name "
            f"({', '.join(sorted(allowed))}); {hint}"
        )


def provenance_lines(record: TwinRecord) -> tuple[str, ...]:
    """Return the lines that state a file's origin: ``twin``, ``source``, ``license`` and, where known, ``attribution``.

    Each is ``key: value``, for comments and metadata fields. They do not depend on the machine or the time.
    """
    source = record.source
    prompt = f", from the words: {one_line(source.prompt)}" if source.prompt else ""
    credit = one_line(source.attribution or "")
    return (
        f"twin: {record.twin_id}, revision {record.revision[:16]}, manitwin {record.provenance.manitwin_version}",
        f"source: {source.kind}, sha256 {source.sha256}{prompt}",
        f"license: {license_of(record)}",
        *([f"attribution: {credit}"] if credit else []),
    )


def license_text(record: TwinRecord) -> str:
    """Return LICENSE.txt: licence, attribution, source, and the changes made (CC BY 4.0, section 3(a)(1)(B))."""
    licence = license_of(record)
    lines = [*provenance_lines(record), ""]
    if licence.lower() == UNKNOWN:
        lines.append("The licence of the source is not known: find it out before you pass these files on.")
    else:
        lines.append(f"These files are made of a source under {licence} and stay under that licence.")
        if not licence.lower().startswith("licenseref-") and " " not in licence:
            lines.append(f"Its text: https://spdx.org/licenses/{licence}.html")
        if licence.upper().startswith("CC-BY") and not record.source.attribution:
            lines.append(
                "It asks for attribution, and no author is known: find out whom to credit before you pass them on."
            )
    lines += [
        "",
        "Changes: brought to metres and an upright frame, mesh repaired, convex collision hulls, mass properties, friction, "
        "annotations and grasps added.",
        *(f"- {one_line(repair)}" for repair in (record.mesh.repairs if record.mesh is not None else ())),
    ]
    return "\n".join(lines) + "\n"
