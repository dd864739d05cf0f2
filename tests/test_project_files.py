"""The files that a code host shows: how to cite, what changed, how to contribute."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

import jsonschema
import yaml

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

TEXT = {"type": "string", "minLength": 1}
AUTHORS = {
    "type": "array",
    "minItems": 1,
    "items": {
        "type": "object",
        "additionalProperties": False,
        "properties": dict.fromkeys(("name", "given-names", "family-names", "affiliation", "orcid"), TEXT),
        "anyOf": [{"required": ["name"]}, {"required": ["family-names"]}],
    },
}
CITATION = {  # of the Citation File Format 1.2.0, the keys that the file uses
    "type": "object",
    "additionalProperties": False,
    "required": ["authors", "cff-version", "message", "title"],
    "properties": {
        "cff-version": {"const": "1.2.0"},
        "message": TEXT,
        "type": {"enum": ["software", "dataset"]},
        "title": TEXT,
        "version": TEXT,
        "license": TEXT,
        "authors": AUTHORS,
        "keywords": {"type": "array", "items": TEXT, "minItems": 1, "uniqueItems": True},
        "references": {
            "type": "array",
            "minItems": 1,
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["authors", "title", "type"],
                "properties": {
                    "type": {"enum": ["article", "conference-paper", "generic"]},
                    "title": TEXT,
                    "url": {"type": "string", "pattern": "^https://"},
                    "authors": AUTHORS,
                },
            },
        },
    },
}


def citation() -> dict[str, Any]:
    read: dict[str, Any] = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    return read


def test_the_citation_is_of_the_format_and_of_this_version() -> None:
    jsonschema.validate(citation(), CITATION)
    assert citation()["version"] == PROJECT["version"]
    assert citation()["license"] == PROJECT["license"]


def test_the_citation_names_the_paper_and_its_authors() -> None:
    (paper,) = citation()["references"]
    assert paper["title"] == "ManiTwin: Scaling Data-Generation-Ready Digital Object Dataset to 100K"
    assert paper["title"] in (ROOT / "README.md").read_text()
    assert len(paper["authors"]) == 16


def test_the_changelog_has_the_headings_of_keep_a_changelog() -> None:
    text = (ROOT / "CHANGELOG.md").read_text()
    versions = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert versions[0] == "[Unreleased]"
    assert all(re.fullmatch(r"\[\d+\.\d+\.\d+\] - \d{4}-\d\d-\d\d", version) for version in versions[1:])
    kinds = set(re.findall(r"^### (.*)$", text, re.MULTILINE))
    assert kinds and kinds <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}


def test_what_contributors_are_told_to_run_and_read_is_there() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text()
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"\bmake ([\w-]+)", text)) <= targets
    places = re.findall(r"\]\(([^)#]+)", text) + re.findall(r"`((?:src|tests|docs)/[\w/.]+)`", text)
    assert len(places) > 8
    assert [place for place in places if not (ROOT / place).exists()] == []
