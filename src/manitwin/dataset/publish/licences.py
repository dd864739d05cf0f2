"""Licences of published twins: selection by licence, attribution page, and the hub's licence identifiers."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from manitwin.errors import UsageError
from manitwin.formats.markdown import markdown_escaped, table
from manitwin.pipeline.quality import REHEARSAL

UNKNOWN = "unknown"
A_REHEARSAL = ""
"""Reason of refusal, in place of licence names, for twins whose licences allow publication but that are rehearsals."""
LICENSES_MD = "LICENSES.md"

_IDS_SHOWN = 50
"""Number of twins listed per author; the index has the others."""

OF_TWINS = (
    "Each twin is a work made of its source (a photo, a text or a mesh, which is in the shard too) and stays under that source's "
    "licence. Licence, attribution and the source's sha256 of every single twin are the columns `license`, `attribution` and "
    "`source_sha256` of `index/twins-*.parquet`."
)
_HUB_NAMES = {"odbl-1.0": "odbl", "odc-by-1.0": "odc-by", "pddl-1.0": "pddl"}


class Terms(NamedTuple):
    """The properties that decide on publication: licence, and whether a rehearsal server (``manitwin fake``) took part."""

    licence: str
    rehearsal: bool


@dataclass(frozen=True)
class Selection:
    """Published ids with their consecutive numbers, ids kept back, and the number of those per licence.

    ``rehearsals`` counts those kept back only because a rehearsal server made part of them.
    """

    published: dict[str, int]
    kept_back: frozenset[str]
    left_out: dict[str, int]
    rehearsals: int


class LicencePolicy:
    """Terms of publication: allowed licences by case-insensitive name (None: all but unknown), and whether rehearsals are
    allowed.
    """

    def __init__(self, licences: Iterable[str] | None, with_rehearsals: bool):
        self._named = None if licences is None else {name.strip().lower() for name in licences if name.strip()}
        self._with_rehearsals = with_rehearsals

    def refusal(self, twins: Sequence[Terms]) -> str | None:
        """Return why an item with these twins may not be published, ``CC-BY-NC-4.0 + unknown`` or ``A_REHEARSAL``; None if it
        may.
        """
        forbidden = {twin.licence for twin in twins if not self._has(twin.licence.lower())}
        if forbidden:
            return " + ".join(sorted(forbidden))
        return None if self._with_rehearsals or not any(twin.rehearsal for twin in twins) else A_REHEARSAL

    def _has(self, licence: str) -> bool:
        return licence != UNKNOWN if self._named is None else licence in self._named


def terms_of(twins: Iterable[Mapping[str, Any]]) -> Iterator[tuple[str, list[Terms]]]:
    """Yield the id and terms of twins, given as rows with ``twin_id``, ``license`` and ``failed_checks``."""
    for twin in twins:
        yield twin["twin_id"], [Terms(twin["license"] or UNKNOWN, REHEARSAL in twin["failed_checks"])]


def select(noun: str, things: Iterable[tuple[str, Sequence[Terms]]], allowed: LicencePolicy) -> Selection:
    """Select the items whose twins are all allowed; raises UsageError if none is."""
    published, kept_back, left_out = dict[str, int](), set[str](), Counter[str]()
    for name, twins in things:
        why = allowed.refusal(twins)
        if why is None:
            published[name] = len(published)
        else:
            kept_back.add(name)
            left_out[why] += 1
    rehearsals = left_out.pop(A_REHEARSAL, 0)
    if not published:
        raise _nothing_published_error(noun, left_out, rehearsals)
    return Selection(published, frozenset(kept_back), dict(sorted(left_out.items())), rehearsals)


def _nothing_published_error(noun: str, left_out: Mapping[str, int], rehearsals: int) -> UsageError:
    if rehearsals:
        return UsageError(
            f"no {noun} can be published: {rehearsals:,} were made with a rehearsal server (manitwin fake); build the"
            f" twins with real models into a new folder, or give --with-rehearsals"
        )
    if not left_out:
        return UsageError(f"there is no {noun} to publish; make some first")
    there = ", ".join(f"{name} ({count})" for name, count in sorted(left_out.items()))
    return UsageError(
        f"no {noun} can be published; their licences are not allowed: {there}; name allowed licences in"
        f" --license-allow,"
        f" {UNKNOWN!r} too if you know that you are permitted"
    )


def without_attribution(twins: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the ids of twins under a Creative Commons licence that requires attribution but without an attribution."""
    return [t["twin_id"] for t in twins if t["license"].upper().startswith("CC-BY") and not t["attribution"]]


def licenses_page(name: str, twins: Sequence[Mapping[str, Any]], *, introduction: str = OF_TWINS) -> str:
    """Return LICENSES.md: every licence, the authors to credit under it, and their twins.

    ``twins`` are rows with ``twin_id``, ``license``, ``attribution``, sorted by id. ``introduction`` states what the licences
    cover.
    """
    by_licence: dict[str, dict[str, list[str]]] = {}
    for twin in twins:
        authors = by_licence.setdefault(twin["license"], {})
        authors.setdefault(twin["attribution"] or "", []).append(twin["twin_id"])
    counted = [[_licence_link(name), f"{sum(map(len, ids.values())):,}"] for name, ids in sorted(by_licence.items())]
    lines = [
        f"# Licences of {markdown_escaped(name)}",
        "",
        introduction,
        "",
        *table(["licence", "twins"], counted),
    ]
    missing = without_attribution(twins)
    if missing:
        lines += ["", f"**{len(missing):,} twins are under a licence that asks for attribution, and none is known.**"]
    for licence, authors in sorted(by_licence.items()):
        lines += ["", f"## {markdown_escaped(licence)}", ""]
        for author, ids in sorted(authors.items()):
            shown = ", ".join(ids[:_IDS_SHOWN])
            more = f" and {len(ids) - _IDS_SHOWN:,} more" if len(ids) > _IDS_SHOWN else ""
            lines.append(f"- {markdown_escaped(author) or 'no attribution known'}: {shown}{more}")
    return "\n".join(lines) + "\n"


def _licence_link(licence: str) -> str:
    words = markdown_escaped(licence)
    if licence == UNKNOWN or licence.startswith("LicenseRef-") or " " in licence:
        return words
    return f"[{words}](https://spdx.org/licenses/{licence}.html)"


HUB_LICENSES = frozenset(
    {
        "apache-2.0",
        "mit",
        "afl-3.0",
        "artistic-2.0",
        "bsl-1.0",
        "bsd-2-clause",
        "bsd-3-clause",
        "bsd-3-clause-clear",
        "c-uda",
        "cc0-1.0",
        "cc-by-2.0",
        "cc-by-2.5",
        "cc-by-3.0",
        "cc-by-4.0",
        "cc-by-sa-3.0",
        "cc-by-sa-4.0",
        "cc-by-nc-2.0",
        "cc-by-nc-3.0",
        "cc-by-nc-4.0",
        "cc-by-nd-4.0",
        "cc-by-nc-nd-3.0",
        "cc-by-nc-nd-4.0",
        "cc-by-nc-sa-2.0",
        "cc-by-nc-sa-3.0",
        "cc-by-nc-sa-4.0",
        "cdla-sharing-1.0",
        "cdla-permissive-1.0",
        "cdla-permissive-2.0",
        "wtfpl",
        "ecl-2.0",
        "epl-1.0",
        "epl-2.0",
        "etalab-2.0",
        "eupl-1.1",
        "eupl-1.2",
        "isc",
        "lppl-1.3c",
        "ms-pl",
        "mpl-2.0",
        "osl-3.0",
        "ofl-1.1",
        "ncsa",
        "unlicense",
        "postgresql",
        "zlib",
        "unknown",
    }
)
"""Licence identifiers allowed on a card that equal the lower-case SPDX identifier:
https://huggingface.co/docs/hub/repositories-licenses
"""


def hub_license(licences: Iterable[str]) -> dict[str, str]:
    """Return the licence fields of the card: the hub's identifier if there is one licence, else ``other`` with a name
    and a link.
    """
    different = sorted(set(licences))
    if len(different) == 1:
        lower = different[0].lower()
        if lower in HUB_LICENSES or lower in _HUB_NAMES:
            return {"license": _HUB_NAMES.get(lower, lower)}
    name = "-".join(different[0].lower().split()) if len(different) == 1 else "several-by-twin"
    return {"license": "other", "license_name": name, "license_link": LICENSES_MD}
