"""A licence in the words of the hub's cards."""

from __future__ import annotations

from collections.abc import Iterable

from manitwin.dataset.publish.licences import LICENSES_MD

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

_HUB_NAMES = {"odbl-1.0": "odbl", "odc-by-1.0": "odc-by", "pddl-1.0": "pddl"}


def hub_license(licences: Iterable[str]) -> dict[str, str]:
    """Return the card's fields: the hub's identifier of the one licence, else ``other`` with a name and a link."""
    different = sorted(set(licences))
    if len(different) == 1:
        lower = different[0].lower()
        if lower in HUB_LICENSES or lower in _HUB_NAMES:
            return {"license": _HUB_NAMES.get(lower, lower)}
    name = "-".join(different[0].lower().split()) if len(different) == 1 else "several-by-twin"
    return {"license": "other", "license_name": name, "license_link": LICENSES_MD}
