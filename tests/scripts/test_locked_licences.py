"""The licence of each locked package is known, stated where it is said to be, and one of those that are allowed."""

from __future__ import annotations

import importlib
import re
import subprocess
import sys
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from types import ModuleType

import pytest
from packaging.licenses import canonicalize_license_expression

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"


@pytest.fixture(scope="module")
def script() -> Iterator[ModuleType]:
    """The script as a module."""
    sys.path.insert(0, str(SCRIPTS))
    try:
        yield importlib.import_module("locked_licences")
    finally:
        sys.path.remove(str(SCRIPTS))


def test_every_locked_package_is_under_a_known_and_allowed_licence(script: ModuleType) -> None:
    found = list(script.licences(script.LOCK.read_text()))
    assert len(found) > 200
    assert {licence.name: licence.not_allowed for licence in found if licence.not_allowed} == {}


def test_expressions_are_of_spdx(script: ModuleType) -> None:
    for licence in script.licences(script.LOCK.read_text()):
        assert canonicalize_license_expression(licence.expression) == licence.expression, licence.name
    for name in script.ALLOWED:
        assert canonicalize_license_expression(name) == name


def test_pebble_qhull_and_usd_are_what_their_wheels_say(script: ModuleType) -> None:
    stated = {licence.name: licence.expression for licence in script.licences(script.LOCK.read_text())}
    assert stated["pebble"] == "LGPL-3.0-only"
    assert stated["cmeel-qhull"] == "Qhull"
    assert stated["usd-core"] == "LicenseRef-TOST-1.0"


def words(name: str, file: str) -> str:
    """The text of a file of an installed wheel, or of its metadata folder, in lower case with single spaces."""
    package = distribution(name)
    for path in package.files or []:
        # newer builds of a wheel have its licences in a folder of theirs
        if str(path) == file or str(path).endswith((f".dist-info/{file}", f".dist-info/licenses/{file}")):
            return " ".join(Path(str(package.locate_file(path))).read_text(errors="replace").lower().split())
    pytest.fail(f"{name} has no file {file}")


SIGNS = {
    "Apache-2.0": "apache",
    "BSD-2-Clause": "redistributions in binary form must reproduce|bsd 2-clause license|license: freebsd",
    "BSD-3-Clause": "endorse or promote products|bsd 3-clause",
    "LGPL-3.0-only": "gnu lesser general public license version 3",
    "MIT": "permission is hereby granted, free of charge",
    "PSF-2.0": "python software foundation license version 2",
    "LicenseRef-BSD": "license :: osi approved :: bsd license",
    "LicenseRef-Public-Domain": "public domain",
    "LicenseRef-matplotlib": "license agreement for matplotlib",
    "Qhull": "qhull is free software",
}


def test_licences_that_a_person_read_stand_in_the_files_named(script: ModuleType) -> None:
    for package, (expression, file) in script.READ.items():
        name, _, version = package.partition("==")
        installed = distribution(name).version
        if installed != version and (version or f"{name}=={installed}" in script.READ):
            continue
        text = words(name, file)
        for licence in re.split(r" AND | OR ", expression):
            assert re.search(SIGNS[licence], text), (name, licence)
        if expression == "BSD-2-Clause":
            assert not re.search(SIGNS["BSD-3-Clause"], text), name


def test_wheels_that_carry_the_text_of_the_gpl_are_explained(script: ModuleType) -> None:
    carrying = set()
    for name, _version in script.locked(script.LOCK.read_text()):
        try:
            package = distribution(name)
        except PackageNotFoundError:
            continue
        if any(script.carries_copyleft(text) for _file, text in script.licence_texts(package)):
            carrying.add(name)
    assert carrying == set(script.CARRIED)


@pytest.mark.parametrize(
    ("expression", "refused"),
    [
        (None, ["unknown"]),
        ("GPL-3.0-only", ["GPL-3.0-only"]),
        ("MIT AND AGPL-3.0-only", ["AGPL-3.0-only"]),
        ("MIT OR GPL-2.0-only", []),
        ("(MIT OR GPL-2.0-only) AND CC-BY-NC-4.0", ["CC-BY-NC-4.0"]),
        ("Apache-2.0 AND MIT", []),
    ],
)
def test_what_is_unknown_or_not_allowed_is_refused(
    script: ModuleType, expression: str | None, refused: list[str]
) -> None:
    assert script.Licence("name", "1.0", expression, "METADATA").not_allowed == refused


def test_the_command_prints_a_line_a_package_and_fails_for_one_without_a_licence(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, SCRIPTS / "locked_licences.py"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "pebble 5" in done.stdout and "LGPL-3.0-only (licenses/LICENSE)" in done.stdout
    lock = tmp_path / "requirements.lock"
    lock.write_text("no-such-package==1.0 \\\n    --hash=sha256:00\nnumpy==2.0\n")
    done = subprocess.run([sys.executable, SCRIPTS / "locked_licences.py", lock], capture_output=True, text=True)
    assert done.returncode == 1
    assert "not allowed: no-such-package: unknown" in done.stderr


def test_a_package_for_another_system_is_known_though_it_is_installed_here(
    script: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(script, "ELSEWHERE", {"numpy": "BSD-3-Clause"})
    monkeypatch.setattr(script, "stated", lambda package: None)
    assert [licence.expression for licence in script.licences("numpy==1.0 ; sys_platform == 'win32'\n")] == [
        "BSD-3-Clause"
    ]
