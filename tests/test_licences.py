"""The default install has no GPL, AGPL or non-commercial part; LGPL only as an unmodified dependency."""

import re
from importlib.metadata import PackageNotFoundError, distribution

from packaging.requirements import Requirement

FORBIDDEN = re.compile(r"(?<![L])\bA?GPL|(?<!Lesser )General Public License|Affero|non-?commercial", re.IGNORECASE)
NOT_IN_THE_WHEEL = {"docutils": re.compile(r"\.el$")}
"""Packages whose classifiers name the GPL for files that their wheel leaves out: how those files are called.

docutils is in the public domain and under BSD licences; its mode for Emacs alone is under the GPL
(its COPYING.rst, "Exceptions"), and comes with the source only.
"""
ALLOWED = re.compile(r"LGPL|Lesser General Public|Library General Public", re.IGNORECASE)


def default_closure() -> set[str]:
    """Names of everything that installing manitwin without extras brings."""
    names, todo = set(), ["manitwin"]
    while todo:
        name = todo.pop()
        if name in names:
            continue
        names.add(name)
        for text in distribution(name).requires or []:
            requirement = Requirement(text)
            if requirement.marker is None or requirement.marker.evaluate({"extra": ""}):
                try:
                    distribution(requirement.name)
                except PackageNotFoundError:
                    continue
                todo.append(requirement.name.lower())
    return names


def stated_licences(name: str) -> list[str]:
    metadata = distribution(name).metadata
    classifiers = [c for c in metadata.get_all("Classifier") or [] if c.startswith("License ::")]
    text = metadata.get("License") or ""
    return [*classifiers, metadata.get("License-Expression") or "", text if len(text) < 200 else text[:200]]


def test_no_copyleft_part_in_the_default_install() -> None:
    bad = {
        name: licence
        for name in default_closure() - NOT_IN_THE_WHEEL.keys()
        for licence in stated_licences(name)
        if FORBIDDEN.search(ALLOWED.sub("", licence))
    }
    assert not bad


def test_what_is_under_the_gpl_in_docutils_is_not_in_its_wheel() -> None:
    for name, excluded in NOT_IN_THE_WHEEL.items():
        files = [str(file) for file in distribution(name).files or []]
        assert any("COPYING" in file for file in files)
        assert not [file for file in files if excluded.search(file)]


def test_no_wheel_carries_copyleft_modules() -> None:
    # a wheel's own licence may not tell: libigl's is MPL-2, and it carries CGAL (GPL) and TetGen (AGPL)
    bad = [
        str(file)
        for name in default_closure()
        for file in distribution(name).files or []
        if re.search(r"copyleft|tetgen|pyigl|pymeshlab|pymeshfix|LICENSE\.A?GPL", str(file), re.IGNORECASE)
    ]
    assert not bad


def test_the_check_would_see_a_copyleft_licence() -> None:
    assert FORBIDDEN.search("GNU General Public License v3 (GPLv3)")
    assert FORBIDDEN.search("AGPL-3.0-only")
    assert not FORBIDDEN.search(ALLOWED.sub("", "LGPL-3.0-only"))
    assert not FORBIDDEN.search("MIT")
