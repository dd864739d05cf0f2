"""HTML tables of a twin's record: every number with its interval and source."""

from __future__ import annotations

from typing import Any

from manitwin.twin.grasp_summary import GraspSummary
from manitwin.twin.record import Physical, TwinRecord
from manitwin.twin.record_values import Estimate
from manitwin.web.html import number, table

FROM_MESH = "computed from the mesh"
_HEADS = ("", "value", "interval", "source")


def fact_tables(record: TwinRecord) -> str:
    """Return all tables of an accepted twin."""
    parts = []
    if record.physical is not None:
        parts.append(_physical(record.physical, record.provenance.stages.keys()))
    if record.grasps is not None:
        parts.append(_grasps(record.grasps))
    parts += [
        _points(record),
        _placements(record),
        _parts(record),
        _moving(record),
        _mesh(record),
        _naming(record),
        _checks(record),
    ]
    return "".join(parts) + provenance(record)


def _estimate(name: str, estimate: Estimate, unit: str) -> tuple[Any, ...]:
    interval = f"{number(estimate.low)} to {number(estimate.high)}{unit}"
    return (name, f"{number(estimate.value)}{unit}", interval, estimate.source)


def _filling_rows(physical: Physical) -> list[tuple[Any, ...]]:
    """Return a row for each filling state of a closed vessel except the full state, which the twin represents."""
    if physical.filling is None:
        return []
    return [
        (
            f"filled to {number(100 * each.share)} %",
            f"{number(each.mass_kg)} kg, centre of mass at z {number(1000 * each.center_of_mass_m[2])} mm",
            _spread(each.center_of_mass_uncertainty_m),
            physical.filling.assumption,
        )
        for each in physical.filling.states[:-1]
    ]


def _spread(uncertainty_m: float | None) -> str | None:
    return None if uncertainty_m is None else f"± {number(1000 * uncertainty_m)} mm"


def _physical(physical: Physical, stages: Any) -> str:
    along = [f"{number(100 * each)}" for each in physical.extents_m]
    box = [f"{number(100 * each)}" for each in physical.obb.extents_m]
    com = ", ".join(f"{round(1000 * each, 2) + 0.0:.2f}" for each in physical.center_of_mass_m)  # avoids -0.00
    weighed = f"computed: a {physical.mass_distribution} of even density"
    if physical.mass_distribution == "parts":
        weighed = "computed: parts of different density"
    if physical.mass_distribution == "annotated":
        weighed = "as the imported asset gives it"
    moments = [number(physical.inertia_kg_m2[i][i]) for i in range(3)]
    products = [number(physical.inertia_kg_m2[i][j]) for i, j in ((0, 1), (0, 2), (1, 2))]
    scaled = f", scaled by {number(physical.scale_applied)}" if physical.scale_applied != 1 else ""
    rows = [
        ("size (x, y, z)", f"{' × '.join(along)} cm", None, FROM_MESH + scaled),
        ("oriented box", f"{' × '.join(box)} cm", None, FROM_MESH + scaled),
        _estimate("mass", physical.mass_kg, " kg"),
        ("density", f"{number(physical.density_kg_m3)} kg/m³", None, "mass by volume"),
        *_filling_rows(physical),
        _estimate("friction, static", physical.friction_static, ""),
        _estimate("friction, dynamic", physical.friction_dynamic, ""),
        _estimate("restitution", physical.restitution, ""),
        ("centre of mass (x, y, z)", f"{com} mm", _spread(physical.center_of_mass_uncertainty_m), weighed),
        ("inertia (xx, yy, zz)", f"{', '.join(moments)} kg m²", None, weighed),
        ("inertia (xy, xz, yz)", f"{', '.join(products)} kg m²", None, weighed),
        ("material", physical.material, None, physical.mass_kg.source),
    ]
    return table("Physical properties", _HEADS, rows, "Object frame: +Z up, origin at the bottom centre.")


def _grasps(grasps: GraspSummary) -> str:
    summaries: list[tuple[str, GraspSummary | None, str | None]] = [(grasps.gripper, grasps, None)]
    summaries += [(name, other.summary, other.detail) for name, other in sorted(grasps.other_grippers.items())]
    rows: list[tuple[Any, ...]] = []
    for name, summary, reason in summaries:
        if summary is None:
            rows.append((name, None, None, None, None, None, reason))
            continue
        robust, second = summary.robustness, summary.second_opinion
        failed = ", ".join(f"{count} {outcome}" for outcome, count in sorted(summary.failures.items()))
        rows.append(
            (
                name,
                f"{summary.verified} of {summary.simulated}",
                f"{summary.success_rate:.0%}",
                f"{summary.unfiltered_success_rate:.0%} of {summary.unfiltered_simulated}"
                if summary.unfiltered_success_rate is not None
                else None,
                f"{number(robust.median, 2)} ({robust.robust} robust)"
                if robust and robust.median is not None
                else None,
                f"{second.holds_share:.0%} in {second.engine}" if second and second.holds_share is not None else None,
                failed,
            )
        )
    trial = grasps.trial
    confirmed = "" if trial.confirmed_by is None else f" (what moved also in {trial.confirmed_by})"
    note = (
        f"Trial: {trial.engine}{confirmed}, {number(trial.force_n)} N, friction of the fingers"
        f" {number(trial.finger_friction)} and of the object {number(trial.object_friction)}, {trial.combine}; held and slid"
        f" {number(100 * trial.slide_distance_m)} cm along six directions."
    )
    heads = ("gripper", "hold", "share", "without filters", "robustness, median", "held again", "failures")
    return table("Grasps", heads, rows, note)


def _points(record: TwinRecord) -> str:
    if record.points is None:
        return ""
    stage = record.provenance.stages.get("points")
    chosen_by = (stage.model or stage.backend) if stage else None
    rows: list[tuple[Any, ...]] = [
        (
            each.label,
            "functional",
            each.description,
            f"{each.confidence:.2f}",
            each.rationale,
            each.source or chosen_by,
        )
        for each in record.points.functional
    ]
    for each in record.points.grasp:
        held = "" if each.verified is None else f"{each.verified} verified grasps; "
        kind = each.type.replace("_", " ")
        rows.append(
            (
                each.label or kind,
                f"grasp, {kind}",
                each.scenario,
                f"{each.confidence:.2f}",
                held + each.rationale,
                each.source or chosen_by,
            )
        )
    return table("Points", ("point", "kind", "what for", "confidence", "why", "source"), rows)


def _placements(record: TwinRecord) -> str:
    rows = [
        (
            f"placement {place}",
            f"{each.probability:.0%}",
            each.upright,
            each.settled,
            f"{number(100 * each.collision_radius_m)} cm",
        )
        for place, each in enumerate(record.placements or (), 1)
    ]
    return table("Placements", ("", "probability", "upright", "settled in simulation", "radius"), rows)


def _moving(record: TwinRecord) -> str:
    """Return the tables of links and joints of an articulated twin; empty for others."""
    if not record.links:
        return ""
    links = [(link.name, f"{number(link.mass_kg)} kg", len(link.hulls), link.source) for link in record.links]
    joints = []
    for joint in record.joints:
        unit = "m" if joint.type == "prismatic" else "rad"
        limits = "none"
        if joint.lower is not None and joint.upper is not None:
            limits = f"{number(joint.lower)} to {number(joint.upper)} {unit}"
        joints.append(
            (joint.name, joint.type, f"{joint.parent} to {joint.child}", limits, f"{number(joint.locked_at)} {unit}")
        )
    return table("Links", ("link", "mass", "hulls", "source"), links) + table(
        "Joints, locked as it stands", ("joint", "type", "links", "limits", "stands at"), joints
    )


def _parts(record: TwinRecord) -> str:
    rows = [(each.name, f"{each.area_share:.0%}", f"{each.confidence:.2f}", each.source) for each in record.parts]
    return table("Parts", ("part", "share of the surface", "confidence", "source"), rows)


def _mesh(record: TwinRecord) -> str:
    mesh = record.mesh
    if mesh is None:
        return ""
    hulls = mesh.hulls
    rows = [
        ("triangles", f"{mesh.faces:,} ({mesh.vertices:,} vertices)"),
        ("watertight", mesh.watertight),
        ("components", mesh.components),
        ("volume", f"{number(1e6 * mesh.volume_m3)} cm³"),
        ("surface", f"{number(1e4 * mesh.area_m2)} cm²"),
        ("repairs", "; ".join(mesh.repairs)),
        ("collision hulls", f"{hulls.count}, at most {hulls.max_vertices} vertices each"),
        ("volume of the hulls by that of the mesh", f"{hulls.volume_ratio:.3f}"),
        ("distance of the hulls, 95th percentile", f"{number(1000 * hulls.surface_error_p95_m)} mm"),
        ("the opening stays open", hulls.keeps_opening),
    ]
    return table("Mesh", ("", FROM_MESH), rows)


def _naming(record: TwinRecord) -> str:
    if record.naming is None:
        return ""
    rows = [(each.name, f"{each.probability:.0%}") for each in record.naming.likeliest]
    return table("Named by a classifier", ("may be", "probability"), rows)


def _checks(record: TwinRecord) -> str:
    said = {True: "passed", False: "failed", None: "not judged"}
    rows = [(each.name, said[each.passed], each.value, each.limit, each.message) for each in record.quality.checks]
    return table("Quality checks", ("check", "", "value", "limit", "remark"), rows)


def provenance(record: TwinRecord) -> str:
    """Return the tables of a twin's source and of the backend of each stage."""
    source = record.source
    origin = [
        ("kind", source.kind), ("file", source.file), ("words", source.prompt), ("licence", source.license),
        ("credit", source.attribution), ("sha256", source.sha256), ("twin", record.twin_id),
        ("revision", record.revision), ("made by", f"manitwin {record.provenance.manitwin_version}"),
        ("seed", record.provenance.seed), ("configuration", record.provenance.config_sha256),
    ]  # fmt: skip
    stages = [
        (name, each.version, each.backend, each.model, "yes" if each.rehearsal else None)
        for name, each in record.provenance.stages.items()
    ]
    heads = ("stage", "version", "backend", "model", "rehearsed")
    return table("Source", ("", ""), origin) + table("Stages", heads, stages)
