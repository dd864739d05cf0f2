from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from manitwin.dataset.publish.licences import (
    LicencePolicy,
    Selection,
    hub_license,
    licenses_page,
    terms_of,
    without_attribution,
)
from manitwin.dataset.publish.licences import select as select_things
from manitwin.dataset.publish.publish import publish_dataset
from manitwin.errors import UsageError

ROWS: list[dict[str, Any]] = [
    {"twin_id": "a", "license": "CC-BY-4.0", "attribution": "Ada"},
    {"twin_id": "b", "license": "CC-BY-4.0", "attribution": None},
    {"twin_id": "c", "license": "CC0-1.0", "attribution": None},
    {"twin_id": "d", "license": "unknown", "attribution": None},
]
for row in ROWS:
    row["failed_checks"] = ["category_known"]


def select(rows: list[dict[str, Any]], allow: list[str] | None, *, with_rehearsals: bool = False) -> Selection:
    return select_things("accepted twin", terms_of(rows), LicencePolicy(allow, with_rehearsals))


@pytest.mark.parametrize(
    ("allow", "out", "left"),
    [
        (None, "abc", {"unknown": 1}),
        (["CC0-1.0"], "c", {"CC-BY-4.0": 2, "unknown": 1}),
        (["cc-by-4.0", " unknown"], "abd", {"CC0-1.0": 1}),
    ],
)
def test_only_what_is_named_goes_out_and_unknown_never_by_itself(
    allow: list[str] | None, out: str, left: dict[str, int]
) -> None:
    selection = select(ROWS, allow)
    assert "".join(sorted(selection.published)) == out and selection.left_out == left
    assert selection.published.keys() ^ selection.kept_back == set("abcd")


def test_rehearsals_stay_unless_they_are_asked_for_and_are_counted() -> None:
    rows = [*ROWS, {"twin_id": "e", "license": "CC0-1.0", "attribution": None, "failed_checks": ["rehearsal"]}]
    selection = select(rows, None)
    assert "".join(sorted(selection.published)) == "abc" and selection.rehearsals == 1 and "e" in selection.kept_back
    asked = select(rows, None, with_rehearsals=True)
    assert "".join(sorted(asked.published)) == "abce" and asked.rehearsals == 0
    with pytest.raises(UsageError, match=r"1 were made with a rehearsal server .*--with-rehearsals"):
        select(rows[4:], None)


@pytest.mark.parametrize("allow", [["MIT"], [""], []])
def test_nothing_to_publish_says_which_licences_are_there(allow: list[str]) -> None:
    with pytest.raises(UsageError, match=r"CC-BY-4.0 \(2\), CC0-1.0 \(1\), unknown \(1\).*--license-allow"):
        select(ROWS, allow)


def test_nothing_there_is_not_called_a_matter_of_licences() -> None:
    with pytest.raises(UsageError, match="there is no accepted twin to publish") as raised:
        select([], None)
    assert "licence" not in str(raised.value)


def test_unknown_alone_is_refused_by_default() -> None:
    with pytest.raises(UsageError, match="unknown"):
        select(ROWS[3:], None)


@pytest.mark.parametrize(
    ("licences", "fields"),
    [
        ({"CC-BY-4.0"}, {"license": "cc-by-4.0"}),
        ({"ODbL-1.0"}, {"license": "odbl"}),
        ({"unknown"}, {"license": "unknown"}),
        (
            {"LicenseRef-Shop 1"},
            {"license": "other", "license_name": "licenseref-shop-1", "license_link": "LICENSES.md"},
        ),
        (
            {"CC-BY-4.0", "CC0-1.0"},
            {"license": "other", "license_name": "several-by-twin", "license_link": "LICENSES.md"},
        ),
    ],
)
def test_card_names_the_one_licence_as_the_hub_does_or_other(licences: set[str], fields: dict[str, str]) -> None:
    assert hub_license(licences) == fields


def test_missing_attribution_is_found_and_said() -> None:
    assert without_attribution(ROWS) == ["b"]
    assert "1 twins are under a licence that asks for attribution" in licenses_page("set", ROWS)
    assert "asks for attribution" not in licenses_page("set", ROWS[:1])


def test_page_names_author_and_twins_of_every_licence(published: Path) -> None:
    page = (published / "LICENSES.md").read_text()
    assert "- Ada: a000000000000000, a100000000000000, a200000000000000, a300000000000000" in page
    assert "- Bob &lt;bob@example.org&gt; \\| et al.: b100000000000000" in page
    assert "- no attribution known: b000000000000000" in page
    assert "c000000000000000" not in page
    assert "| [CC-BY-4.0](https://spdx.org/licenses/CC-BY-4.0.html) | 5 |" in page


def test_what_stays_here_is_counted(dataset: Path, tmp_path: Path) -> None:
    done = publish_dataset(dataset, tmp_path / "out", license_allow=["CC0-1.0"])
    assert (done.twins, done.left_out, done.rejected) == (1, {"CC-BY-4.0": 5, "unknown": 1}, 1)
    assert [p.name for p in (tmp_path / "out").rglob("*.tar")] == ["salad-bowl-000000.tar"]
