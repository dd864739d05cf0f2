"""Audit of one asset: reading it and applying rules."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from manitwin.assets.asset import Asset
from manitwin.assets.asset_files import MESHES
from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.engine_shapes import DRAWN_FORMATS, OF_HULLS, TRIANGLES, with_engine_shapes
from manitwin.assets.audit.finding import Audited, Finding, Rule
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules import RULES_BY_CODE
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError, TwinError
from manitwin.twin.store import RECORD, read_record

STOPS = ("FIL005", "FIL006")
"""Rules whose findings mean that there is no geometry to measure."""

MODELS = (".sdf",)
"""Models that others include; without one, an object lacks a part, as with a missing mesh."""
OF_RUNS = tuple(f"RUN00{number}" for number in range(1, 9))
"""Rules on the drop of a single body; those on moving parts apply to the whole file."""
OF_THE_WHOLE_SHAPE = (
    "MAS001", "MAS003", "MAS004", "INE005", "COM002", "COM003", "COL", "SCL", "FRM005", "GRA", "PLC", "TWN", *OF_RUNS
)  # fmt: skip
"""Rules that measure the shape; skipped if a mesh is missing (FIL002), since the rest of the shape is not representative."""
OF_WHAT_MOVES = ("MAS", "INE", "COM", "COL001", "FRI001", "SCL001", *OF_RUNS)
"""Rules that do not apply to static assets, for which no engine needs a mass."""
OF_RIGID_BODIES = (*OF_WHAT_MOVES, "COL", "FRI", "PLC003")
"""Rules that do not apply to soft assets."""


def audit_asset(
    asset: Asset,
    rules: Sequence[Rule],
    engines: Sequence[str] = (),
    engine: str | None = None,
    root: Path | None = None,
) -> list[Finding]:
    """Apply rules, in order, to an asset as an ``engine`` interprets it (``with_engine_shapes``), and simulate it in ``engines``.

    If the geometry cannot be measured, only that finding is returned; if a mesh is missing, rules on the shape are skipped.
    Moving parts are read again from the files of the asset, below ``root``.
    """
    asset = with_engine_shapes(asset, engine)
    if engine in TRIANGLES:
        rules = [rule for rule in rules if rule.code not in OF_HULLS]
    as_drawn = engine is None and asset.format in DRAWN_FORMATS
    measured = MeasuredAsset(asset, tuple(engines), as_drawn=as_drawn, root=root)
    broken = [code for code in STOPS if measured.complaints(RULES_BY_CODE[code].check)]
    if broken:
        rules = [rule for rule in rules if rule.code in broken]
    elif any(Path(name).suffix.lower() in (*MESHES, *MODELS) for name in asset.missing_files):
        rules = [rule for rule in rules if not rule.code.startswith(OF_THE_WHOLE_SHAPE)]
    if asset.soft:
        rules = [rule for rule in rules if not rule.code.startswith(OF_RIGID_BODIES)]
    if asset.static:
        rules = [rule for rule in rules if not rule.code.startswith(OF_WHAT_MOVES)]
    return [_finding(rule, asset.path, complaint) for rule in rules for complaint in measured.complaints(rule.check)]


def audit_path(
    path: Path,
    rules: Sequence[Rule],
    fix: bool = False,
    root: Path | None = None,
    engines: Sequence[str] = (),
    engine: str | None = None,
) -> Audited:
    """Read an asset below ``root`` and apply rules to it; with ``fix``, apply safe corrections first.

    Errors of the asset become findings and are never raised.
    """
    try:
        asset = read_asset(path, root=root, shape_only=True)
        findings = audit_asset(asset, rules, engines, engine, root)
        done: list[str] = []
        if fix:
            done = _apply_fixes(asset, findings)
            if done:
                asset = read_asset(path, root=root, shape_only=True)
                findings = audit_asset(asset, rules, engines, engine, root)
    except AssetError as error:
        return _unreadable_result(path, str(error), rules)
    except MemoryError:
        return _unreadable_result(path, f"{path.name}: needs more memory than there is", rules)
    return Audited(str(path), asset.format, tuple(findings), tuple(done))


def _apply_fixes(asset: Asset, findings: Sequence[Finding]) -> list[str]:
    by_code = dict.fromkeys(RULES_BY_CODE[finding.code].fix for finding in findings)
    done = [fix(asset) for fix in by_code if fix is not None]
    return [said for said in done if not said.startswith("not fixed")]


def _unreadable_result(path: Path, cause: str, rules: Sequence[Rule]) -> Audited:
    code = "FIL008" if _is_rejected_twin(path) else "FIL001"
    findings = [
        Finding(rule.code, rule.severity, str(path), " ".join(cause.split()), path)
        for rule in rules
        if rule.code == code
    ]
    return Audited(str(path), "twin" if code == "FIL008" else None, tuple(findings))


def _is_rejected_twin(path: Path) -> bool:
    folder = path.parent if path.name == RECORD else path
    try:
        return (folder / RECORD).is_file() and read_record(folder).status == "rejected"
    except TwinError:
        return False


def _finding(rule: Rule, path: Path, complaint: Complaint) -> Finding:
    return Finding(rule.code, rule.severity, str(path), complaint.message, complaint.file, complaint.values)


def audit_by_codes(
    path: Path,
    codes: Sequence[str],
    fix: bool,
    root: Path | None = None,
    engines: Sequence[str] = (),
    engine: str | None = None,
) -> Audited:
    """Audit an asset in an isolated process, to which rules are passed by their codes."""
    return audit_path(path, [RULES_BY_CODE[code] for code in codes], fix, root, engines, engine)
