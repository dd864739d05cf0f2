"""Every rule fires on a mug that is broken in its way, and no other error does; the mug as it is gets none."""

from __future__ import annotations

from pathlib import Path

import pytest
from broken_mugs import BROKEN, codes, errors
from made_mug import clean, write_urdf

from manitwin.assets.audit.check import audit_asset, audit_path
from manitwin.assets.audit.rules import RULES, RULES_BY_CODE

ON_DISK = {"FIL001", "FIL003", "FIL004", "FIL008", "TWN001", "TWN002", "TWN003", "TWN004", "TWN005", "TWN006"}
"""Tested with files: below, in test_rules_of_twins.py and in test_joint_rules_of_twins.py."""


def test_no_rule_complains_of_the_mug() -> None:
    assert audit_asset(clean(), RULES) == []


def test_every_rule_has_its_broken_mug() -> None:
    running = {code for code in RULES_BY_CODE if code.startswith("RUN")}  # test_engine_runs.py
    assert set(BROKEN) | ON_DISK | running == set(RULES_BY_CODE)


@pytest.mark.parametrize("code", BROKEN)
def test_rule_fires_on_its_broken_mug_and_no_other_error_does(code: str) -> None:
    findings = audit_asset(BROKEN[code](clean()), RULES)
    assert code in codes(findings), findings
    assert errors(findings) <= {code}, findings


def test_no_rule_complains_of_the_mug_as_a_urdf(tmp_path: Path) -> None:
    assert audit_path(write_urdf(tmp_path), RULES).findings == ()


def test_broken_xml_is_a_finding(tmp_path: Path) -> None:
    (tmp_path / "mug.urdf").write_text("<robot name='mug'><link>")
    found = audit_path(tmp_path / "mug.urdf", RULES)
    assert codes(found.findings) == {"FIL001"} and found.format is None
    assert "\n" not in found.findings[0].message


def test_copied_mesh_is_found_by_its_bytes(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path)
    (tmp_path / "copy.obj").write_bytes((tmp_path / "mug.obj").read_bytes())
    visual = '<visual><geometry><mesh filename="mug.obj"/></geometry></visual>'
    urdf.write_text(urdf.read_text().replace(visual, visual + visual.replace("mug.obj", "copy.obj")))
    findings = audit_path(urdf, RULES).findings
    assert "FIL003" in codes(findings) and errors(findings) == set()
