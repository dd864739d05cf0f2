"""The licences of published twins: which may go out, whom to credit, and each in the words of the hub's cards."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from manitwin.errors import UsageError
from manitwin.formats.markdown import markdown_escaped, table
from manitwin.pipeline.quality import REHEARSAL

UNKNOWN = "unknown"
LICENSES_MD = "LICENSES.md"

_IDS_SHOWN = 50
"""Twins of one author that are listed; of more the index tells."""

OF_TWINS = (
    "Each twin is a work made of its source (a photo, a text or a mesh, which is in the shard too) and stays under that source's "
    "licence. Licence, attribution and the source's sha256 of every single twin are the columns `license`, `attribution` and "
    "`source_sha256` of `index/twins-*.parquet`."
)
_HUB_NAMES = {"odbl-1.0": "odbl", "odc-by-1.0": "odc-by", "pddl-1.0": "pddl"}


@dataclass(frozen=True)
class Selection:
    """The ids of the twins that go out and of those that stay here, and how many of these there are by licence.

    ``rehearsals`` are those that stay although their licence lets them go: a rehearsal server made part of them.
    """

    published: frozenset[str]
    kept_back: frozenset[str]
    left_out: dict[str, int]
    rehearsals: int = 0


@dataclass(frozen=True)
class Allowed:
    """The licences that may go out: those that are named, in lower case; None: all that are known."""

    named: frozenset[str] | None

    @classmethod
    def of(cls, names: Iterable[str] | None) -> Allowed:
        """Take licences by name, in any case."""
        return cls(None if names is None else frozenset(name.strip().lower() for name in names if name.strip()))

    def has(self, licence: str | None) -> bool:
        """Tell whether a licence may go out; None is the unknown one."""
        lower = (licence or UNKNOWN).lower()
        return lower != UNKNOWN if self.named is None else lower in self.named


def select(
    twins: Iterable[Mapping[str, Any]], allow: Iterable[str] | None, *, with_rehearsals: bool = False
) -> Selection:
    """Choose the twins whose licence is named in ``allow`` (in any case), or known at all where nothing is named.

    Those that a rehearsal server had a part in stay here unless ``with_rehearsals``. ``twins`` are rows with ``twin_id``,
    ``license`` and ``failed_checks``. Raises UsageError where nothing may go out.
    """
    allowed = Allowed.of(allow)
    published, kept_back, left_out, rehearsals = set[str](), set[str](), Counter[str](), 0
    for twin in twins:
        if not allowed.has(twin["license"]):
            left_out[twin["license"] or UNKNOWN] += 1
        elif not with_rehearsals and REHEARSAL in twin["failed_checks"]:
            rehearsals += 1
        else:
            published.add(twin["twin_id"])
            continue
        kept_back.add(twin["twin_id"])
    check_some_go_out("accepted twin", len(published), left_out, rehearsals)
    return Selection(frozenset(published), frozenset(kept_back), dict(sorted(left_out.items())), rehearsals)


def check_some_go_out(noun: str, count: int, left_out: Mapping[str, int], rehearsals: int) -> None:
    """Raise UsageError where the ``count`` of what goes out is 0; others stay by licence, or because they are rehearsals."""
    if count:
        return
    if rehearsals:
        raise UsageError(
            f"no {noun} may go out: {rehearsals:,} are rehearsals, made by manitwin fake and not by models; build the"
            " twins again with models into a new folder, or ask for them with --with-rehearsals"
        )
    if not left_out:
        raise UsageError(f"no {noun} is there, so nothing can go out; make some first")
    there = ", ".join(f"{name} ({count})" for name, count in sorted(left_out.items()))
    raise UsageError(
        f"no {noun} may go out; licences that keep them here: {there}; name those that may in --license-allow,"
        f" {UNKNOWN!r} too if you know that you may"
    )


def without_attribution(twins: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the ids of twins under a Creative Commons licence that asks for attribution, of which none is known."""
    return [t["twin_id"] for t in twins if t["license"].upper().startswith("CC-BY") and not t["attribution"]]


def licenses_page(name: str, twins: Sequence[Mapping[str, Any]], *, introduction: str = OF_TWINS) -> str:
    """Return LICENSES.md: every licence, whom to credit under it, and for which twins.

    ``twins`` are rows with ``twin_id``, ``license``, ``attribution``, sorted by id. ``introduction`` says what is under them.
    """
    by_licence: dict[str, dict[str, list[str]]] = {}
    for twin in twins:
        authors = by_licence.setdefault(twin["license"], {})
        authors.setdefault(twin["attribution"] or "", []).append(twin["twin_id"])
    counted = [[_linked(name), f"{sum(map(len, ids.values())):,}"] for name, ids in sorted(by_licence.items())]
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


def _linked(licence: str) -> str:
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
"""The identifiers that a card may name, as far as they are SPDX's in lower case:
https://huggingface.co/docs/hub/repositories-licenses"""


def hub_license(licences: Iterable[str]) -> dict[str, str]:
    """Return the card's fields: the hub's identifier of the one licence, else ``other`` with a name and a link."""
    different = sorted(set(licences))
    if len(different) == 1:
        lower = different[0].lower()
        if lower in HUB_LICENSES or lower in _HUB_NAMES:
            return {"license": _HUB_NAMES.get(lower, lower)}
    name = "-".join(different[0].lower().split()) if len(different) == 1 else "several-by-twin"
    return {"license": "other", "license_name": name, "license_link": LICENSES_MD}
