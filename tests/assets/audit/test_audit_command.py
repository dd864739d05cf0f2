"""Selection, reports, --fix and many assets at once."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import typer
from click.testing import Result
from made_mug import MASS_KG, clean, hulls, textured, write_twin, write_urdf
from typer.testing import CliRunner

from manitwin.assets.audit.baseline import read_baseline
from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.finding import Audited, Finding
from manitwin.assets.audit.report import digest, explanation, json_of, sarif_of, summary, text_of
from manitwin.assets.audit.rules import RULES
from manitwin.assets.audit.run import audit_assets
from manitwin.assets.audit.selection import rule_of, select_rules
from manitwin.assets.read import read_asset
from manitwin.cli.commands.audit import audit as audit_command
from manitwin.cli.main import app
from manitwin.errors import UsageError
from manitwin.formats.glb import write_glb
from manitwin.geometry.hulls.reduction import hull_mesh
from manitwin.geometry.mass_properties import solid_mass_properties
from manitwin.geometry.poses import transform

PLACEHOLDER = '<mass value="0.3"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'


def test_codes_are_stable_in_form_and_each_there_once() -> None:
    codes = [rule.code for rule in RULES]
    assert len(set(codes)) == len(codes)
    assert all(len(code) == 6 and code[:3].isupper() and code[3:].isdigit() for code in codes)
    assert len({rule.name for rule in RULES}) == len(RULES)


def test_selection_is_by_beginnings_and_the_longer_wins() -> None:
    def selected(select: list[str], ignore: list[str]) -> set[str]:
        return {rule.code for rule in select_rules(select, ignore)}

    everything = {rule.code for rule in RULES}
    always = {"FIL001", "FIL005", "FIL006"}
    assert selected([], []) == everything
    assert selected([], ["LIC"]) == everything - {"LIC001", "LIC002"}
    assert selected(["lic", "INE001"], []) == {"LIC001", "LIC002", "INE001"} | always
    assert selected(["INE001"], ["INE"]) == {"INE001"} | always
    assert selected(["INE"], ["INE"]) == always
    assert selected(["LIC"], ["FIL"]) == {"LIC001", "LIC002"}


@pytest.mark.parametrize(("code", "near"), [("INE01", "INE001"), ("MASS", "MAS"), ("XYZ999", "Valid")])
def test_unknown_code_is_an_error_that_names_the_nearest(code: str, near: str) -> None:
    with pytest.raises(UsageError, match=near):
        select_rules([code], [])
    with pytest.raises(UsageError, match=near):
        rule_of(code)


def findings() -> list[Audited]:
    values = {"mass_kg": float("nan"), "bounds_m": [[0.0, 1.0]]}
    found = Finding("MAS002", "error", "set/a mug.urdf", "the mass\nis nan kg", None, values)
    note = Finding("TEX002", "note", "set/a mug.urdf", "odd", Path("/data/ö.png"))
    return [Audited("set/a mug.urdf", "urdf", (found, note)), Audited("set/b.urdf", "urdf", ())]


def test_text_is_one_line_a_finding() -> None:
    first, second = findings()
    assert text_of(first).splitlines() == [
        "set/a mug.urdf (urdf)",
        "  MAS002 error    the mass is nan kg",
        "  TEX002 note     odd",
    ]
    assert text_of(second) == ""
    assert summary(findings()) == "2 assets, 1 without findings: 1 error, 0 warnings, 1 note"


def test_json_has_every_asset_and_no_number_that_json_has_not() -> None:
    content = json.loads(json_of(findings()), parse_constant=lambda word: pytest.fail(word))
    assert content["summary"] == {"assets": 2, "error": 1, "warning": 0, "note": 1}
    assert [asset["asset"] for asset in content["assets"]] == ["set/a mug.urdf", "set/b.urdf"]
    assert content["assets"][0]["findings"][0]["values"] == {"mass_kg": "nan", "bounds_m": [[0.0, 1.0]]}


def closed(properties: dict[str, object], *required: str) -> dict[str, object]:
    return {"type": "object", "additionalProperties": False, "properties": properties, "required": list(required)}


TEXT = {"type": "string"}
MESSAGE = closed({"text": TEXT, "markdown": TEXT, "id": TEXT, "arguments": {"type": "array"}})
STRINGS = closed({"text": TEXT, "markdown": TEXT}, "text")
LEVEL = {"enum": ["none", "note", "warning", "error"]}
LOCATION = closed(
    {
        "physicalLocation": closed(
            {"artifactLocation": closed({"uri": {"type": "string", "format": "uri-reference"}})}
        ),
        "logicalLocations": {
            "type": "array",
            "items": closed({"name": TEXT, "fullyQualifiedName": TEXT, "kind": TEXT}),
        },
    }
)
RULE = closed(
    {
        "id": TEXT, "name": TEXT, "shortDescription": STRINGS, "fullDescription": STRINGS, "help": STRINGS,
        "helpUri": TEXT, "defaultConfiguration": closed({"level": LEVEL}),
    },
    "id",
)  # fmt: skip
RESULT = closed(
    {
        "ruleId": TEXT, "ruleIndex": {"type": "integer", "minimum": -1}, "level": LEVEL, "message": MESSAGE,
        "locations": {"type": "array", "items": LOCATION}, "properties": {"type": "object"},
    },
    "message",
)  # fmt: skip
RUN = closed(
    {
        "tool": closed(
            {"driver": closed({"name": TEXT, "version": TEXT, "rules": {"type": "array", "items": RULE}}, "name")}
        ),
        "columnKind": {"enum": ["utf16CodeUnits", "unicodeCodePoints"]},
        "results": {"type": "array", "items": RESULT},
    },
    "tool",
)
SARIF = closed(
    {"$schema": TEXT, "version": {"enum": ["2.1.0"]}, "runs": {"type": "array", "items": RUN}}, "version", "runs"
)
"""What OASIS' sarif-schema-2.1.0.json says of the objects that are written; it too allows no other properties in them."""


def test_sarif_is_as_its_schema_asks_and_carries_the_rules_help() -> None:
    log = json.loads(sarif_of(findings(), RULES))
    jsonschema.validate(log, SARIF, format_checker=jsonschema.FormatChecker())
    run = log["runs"][0]
    rules = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in rules] == [rule.code for rule in RULES]
    assert all(rules[result["ruleIndex"]]["id"] == result["ruleId"] for result in run["results"])
    uris = [result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"] for result in run["results"]]
    assert uris == ["set/a%20mug.urdf", "file:///data/%C3%B6.png"]
    assert all("docs/audit.md#" in rule["help"]["text"] for rule in rules)


def test_explanation_names_report_and_remedy() -> None:
    text = explanation(rule_of("ine004"))
    assert "EmbodiedGen" in text and "--fix" in text


def test_many_assets_give_the_same_in_one_process_and_in_two(tmp_path: Path) -> None:
    write_twin(tmp_path / "twins")
    write_urdf(tmp_path / "good")
    write_urdf(tmp_path / "placeholder", inertial=PLACEHOLDER)
    (tmp_path / "broken.urdf").write_text("<robot name='x'>")
    one, two = (audit_assets([tmp_path], jobs=jobs) for jobs in (1, 2))
    assert one == two
    codes = {Path(each.asset).relative_to(tmp_path).parts[0]: {f.code for f in each.findings} for each in one}
    assert codes == {"broken.urdf": {"FIL001"}, "good": set(), "placeholder": {"INE004", "COM003"}, "twins": set()}


def test_path_that_is_not_there_is_wrong_use(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"nowhere.*no such file"):
        audit_assets([tmp_path / "nowhere"])


def test_fix_writes_the_inertia_of_the_hulls_and_keeps_the_old_file(tmp_path: Path) -> None:
    urdf = write_urdf(tmp_path, inertial=PLACEHOLDER)
    before = urdf.read_bytes()
    found = audit_path(urdf, RULES, fix=True)
    assert found.findings == () and "the centre of mass and the inertia" in found.fixed[0]
    assert (tmp_path / "mug.urdf.orig").read_bytes() == before
    inertial = read_asset(urdf).inertial
    bodies = [solid_mass_properties(hull_mesh(hull), 1.0) for hull in hulls()]
    volumes = np.array([body.volume_m3 for body in bodies])
    center = volumes @ [body.center_of_mass_m for body in bodies] / volumes.sum()
    tensor = np.zeros((3, 3))
    for volume, body in zip(volumes, bodies, strict=True):
        away = body.center_of_mass_m - center
        tensor += (
            MASS_KG * volume / volumes.sum() * (body.inertia_kg_m2 + away @ away * np.eye(3) - np.outer(away, away))
        )
    assert inertial.center_of_mass_m is not None and inertial.inertia_kg_m2 is not None
    np.testing.assert_allclose(inertial.center_of_mass_m, center, atol=1e-6)
    np.testing.assert_allclose(inertial.inertia_kg_m2, tensor, rtol=1e-3, atol=1e-8)
    assert inertial.mass_kg == MASS_KG


def test_fix_leaves_a_sound_file_and_a_placed_centre_of_mass_alone(tmp_path: Path) -> None:
    sound = write_urdf(tmp_path / "sound")
    before = sound.read_bytes()
    assert audit_path(sound, RULES, fix=True).fixed == () and sound.read_bytes() == before
    placed = write_urdf(tmp_path / "placed", inertial='<origin xyz="0.01 0 0.04"/>' + PLACEHOLDER)
    assert audit_path(placed, RULES, fix=True).findings == ()
    np.testing.assert_allclose(read_asset(placed).inertial.center_of_mass_m, [0.01, 0, 0.04])


def robotwin_folder(folder: Path, *matrices: np.ndarray) -> Path:
    for kind, parts in (("visual", list(clean().visual)), ("collision", [hull_mesh(hull) for hull in hulls()])):
        (folder / kind).mkdir(parents=True)
        content = write_glb([textured(part) for part in parts])
        (folder / kind / "base0.glb").write_bytes(content)
    data = {"scale": [1, 1, 1], "functional_matrix": [matrix.tolist() for matrix in matrices], "stable": True}
    (folder / "model_data0.json").write_text(json.dumps(data))
    return folder / "model_data0.json"


def test_fix_turns_nearly_right_axes_into_a_rotation_and_leaves_mirrored_ones(tmp_path: Path) -> None:
    turn = transform(np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]), np.array([0, 0.1, 0]))
    rounded = turn.copy()
    rounded[:3, :3] = np.round(rounded[:3, :3] * 1.004 + 0.003, 3)
    mirrored = np.diag([1.0, 1, -1, 1])
    file = robotwin_folder(tmp_path / "039_mug", rounded, mirrored)
    found = audit_path(file, select_rules(["FRM"]), fix=True)
    assert {f.code for f in found.findings} == {"FRM002"} and "1 frames orthonormal" in found.fixed[0]
    frames = np.array(json.loads(file.read_text())["functional_matrix"])
    np.testing.assert_allclose(frames[0][:3, :3].T @ frames[0][:3, :3], np.eye(3), atol=1e-12)
    np.testing.assert_allclose(frames[0], turn, atol=0.01)
    np.testing.assert_array_equal(frames[1], mirrored)
    assert json.loads((tmp_path / "039_mug" / "model_data0.json.orig").read_text())["scale"] == [1, 1, 1]


def test_what_most_assets_have_in_common_is_said_once_with_its_count(tmp_path: Path) -> None:
    for name in ("one", "two"):
        write_urdf(tmp_path / name)
        file = next((tmp_path / name).glob("*.urdf"))
        file.write_text(re.sub(r"<!--.*?-->", "", file.read_text(), flags=re.DOTALL))
    (tmp_path / "materials.xml").write_text("<mujoco><asset><material name='m'/></asset></mujoco>")
    done = CliRunner().invoke(app, ["audit", str(tmp_path), "--select", "LIC"])
    assert done.stdout.count("LIC001") == 1 and "LIC001 warning  2 of 2 assets: no licence is stated" in done.stdout
    assert "1 descriptions without a shape" in done.stderr
    alone = CliRunner().invoke(app, ["audit", str(tmp_path / "one"), "--select", "LIC"])
    assert "  LIC001 warning  no licence is stated" in alone.stdout


def test_friction_that_no_asset_of_a_set_declares_is_said_once(tmp_path: Path) -> None:
    for name in ("one", "two", "three"):
        write_urdf(tmp_path / name)
        file = next((tmp_path / name).glob("*.urdf"))
        file.write_text(re.sub(r"<contact>.*?</contact>", "", file.read_text(), flags=re.DOTALL))
    done = CliRunner().invoke(app, ["audit", str(tmp_path), "--select", "FRI001"])
    assert done.stdout.count("no friction is declared") == 1
    assert "FRI001 warning  3 of 3 assets: no friction" in done.stdout
    by_asset = json.loads(CliRunner().invoke(app, ["audit", str(tmp_path), "--format", "json"]).stdout)["assets"]
    assert all("FRI001" in {found["code"] for found in each["findings"]} for each in by_asset)


def test_a_baseline_leaves_out_what_was_known_and_nothing_else(tmp_path: Path, command: Callable[..., Result]) -> None:
    write_urdf(tmp_path / "assets/one", inertial=PLACEHOLDER)
    file = tmp_path / "baseline.json"
    assert command(tmp_path / "assets").exit_code == 1
    written = command(tmp_path / "assets", "--write-baseline", file)
    assert written.exit_code == 0
    assert json.loads(file.read_text())["assets"] == {"assets/one/mug.urdf": ["COM003", "INE004"]}
    known = command(tmp_path / "assets", "--baseline", file)
    assert known.exit_code == 0 and "1 assets, 1 without findings" in known.stdout
    write_urdf(tmp_path / "assets/two", inertial=PLACEHOLDER)
    new = command(tmp_path / "assets", "--baseline", file)
    assert new.exit_code == 1 and "two/mug.urdf" in new.stdout and "one/mug.urdf" not in new.stdout


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "no such baseline"),
        ("{", "is broken"),
        ("[]", "not an object"),
        ('{"version": 2, "assets": {}}', "no baseline of version 1"),
        ('{"version": 1, "assets": {"a": "INE004"}}', "no list of texts"),
    ],
)
def test_a_file_that_is_no_baseline_is_refused_with_the_remedy(tmp_path: Path, content: str | None, said: str) -> None:
    file = tmp_path / "baseline.json"
    if content is not None:
        file.write_text(content)
    with pytest.raises(UsageError, match=said) as error:
        read_baseline(file)
    assert "--write-baseline" in str(error.value)


def test_many_assets_end_with_what_they_amount_to() -> None:
    def found(name: str, code: str, severity: str, message: str) -> Audited:
        return Audited(name, None, (Finding(code, severity, name, message),))  # type: ignore[arg-type]

    audited = [
        *(found(f"{n}.urdf", "FIL001", "error", f"{n}.urdf: joint 'j{n}' has 3.{n} values; mend it") for n in range(3)),
        found("a.urdf", "LIC001", "warning", "no licence is stated"),
        found("b.urdf", "INE004", "error", "the inertia is the identity"),
    ]
    assert digest(audited, RULES).splitlines() == [
        "assets by rule",
        "       3 error    FIL001 unreadable",
        "       1 error    INE004 inertia-placeholder",
        "       1 warning  LIC001 licence-missing",
        "not read or without geometry, by cause",
        "       3 joint ... has N values, as 0.urdf",
        "most errors",
        *(f"       1 and 0 warnings: {name}.urdf" for name in "012b"),
    ]


def test_page_of_the_rules_is_that_of_the_code() -> None:
    root = Path(__file__).resolve().parents[3]
    done = subprocess.run(
        [sys.executable, root / "docs" / "make_audit_page.py", "--check"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    page = (root / "docs" / "audit.md").read_text(encoding="utf-8")
    assert all(f'<a id="{rule.code.lower()}"></a>' in page for rule in RULES)


@pytest.fixture
def command() -> Callable[..., Result]:
    app = typer.Typer()
    app.command()(audit_command)
    return lambda *words: CliRunner().invoke(app, [str(word) for word in words])


def test_command_exits_1_on_errors_and_0_without(tmp_path: Path, command: Callable[..., Result]) -> None:
    write_urdf(tmp_path / "good")
    assert command(tmp_path).exit_code == 0
    write_urdf(tmp_path / "bad", inertial=PLACEHOLDER)
    found = command(tmp_path)
    assert found.exit_code == 1 and "INE004 error" in found.stdout
    assert found.stdout.splitlines()[-1] == "2 assets, 1 without findings: 1 error, 1 warning, 0 notes"
    assert command(tmp_path, "--ignore", "INE").exit_code == 0
    assert json.loads(command(tmp_path, "--format", "json").stdout)["summary"]["error"] == 1
    assert json.loads(command(tmp_path, "--format", "sarif", "--select", "INE").stdout)["runs"][0]["results"]
    assert command(tmp_path, "--fix").exit_code == 0 and command(tmp_path).exit_code == 0


def test_command_explains_a_rule(command: Callable[..., Result]) -> None:
    found = command("--explain", "mas003")
    assert found.exit_code == 0 and found.stdout.startswith("MAS003 mass-against-volume (error)")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "no PATH"),
        (("--format", "xml", "."), "sarif"),
        (("--select", "MASS", "."), "MAS"),
        (("nowhere",), "nowhere"),
    ],
)
def test_command_refuses_wrong_use(command: Callable[..., Result], words: tuple[str, ...], said: str) -> None:
    found = command(*words)
    assert isinstance(found.exception, UsageError) and said in str(found.exception)


def test_command_refuses_a_folder_without_assets(tmp_path: Path, command: Callable[..., Result]) -> None:
    found = command(tmp_path)
    assert isinstance(found.exception, UsageError) and "no asset of a known format" in str(found.exception)
