"""Quality findings that do not reject a twin but are reported and can be filtered by (paper, "Failure Cases and Filtering")."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from manitwin.engine.stage import Draft
from manitwin.formats.printable import printable_line
from manitwin.pipeline.grasps import GRASP_POINTS
from manitwin.pipeline.guesses import OF_NO_NAME, naming_checks, shape_checks, size_checks, template_checks
from manitwin.pipeline.photo_thinning import thinned_words
from manitwin.pipeline.suspicious_size import usual_size_checks
from manitwin.twin.import_record import read_import_record
from manitwin.twin.proportions import wilson_interval
from manitwin.twin.record_values import Check

UNCOVERED_LIMIT_M = 0.002
"""Largest distance of the surface from the hulls; beyond it fingers would sink in (docs/measured/meshes.md)."""

CAVITY_LIMIT = 0.8
"""Least share of the open cavity kept by the hulls; below it a container holds visibly less than it shows."""

HOLE_LIMIT = 0.5
"""Least open share of each straight through hole, in projection; below it objects that fit would not pass."""

AGREEMENT_LIMIT = 0.9
"""Least share of the verified grasps confirmed by a second engine; below it the engines disagree on the object as a whole."""

CENTER_OF_MASS_LIMIT = 0.1
"""Fraction of the longest side: uncertainty beyond which the centre of mass may decide whether a grasp holds."""

REHEARSAL = "rehearsal"
"""Name of the check that is present, and failed, only if a rehearsal server replaced a model."""

ESTIMATES = ("mass_kg", "friction_static", "friction_dynamic", "restitution")


def quality_checks(draft: Draft) -> list[dict[str, Any]]:
    """Collect the gate's checks and the findings of later stages, in stage order."""
    checks = [
        *rehearsal_checks(draft),
        *naming_checks(draft),
        *(Check(**check) for check in draft.field("gate")["checks"]),
    ]
    if "matte" in draft.fields:
        matte = draft.field("matte")
        checks.append(
            Check(
                name="matte",
                passed=not matte["findings"],
                value=matte["confidence"],
                message="; ".join(matte["findings"]),
            )
        )
    checks += size_checks(draft)
    checks += usual_size_checks(draft)
    checks += _unseen(draft)
    checks += template_checks(draft)
    checks += shape_checks(draft)
    checks += photos_checks(draft)
    findings = [*findings_of_import(draft), *draft.field("geometry")["findings"]]
    checks.append(
        Check(
            name="input_as_declared",
            passed=not findings,
            value=float(len(findings)),
            limit=0.0,
            message="; ".join(findings),
        )
    )
    for checks_of in (_physical_checks, _examined, _frame_checks, _collision_checks, _grasp_checks, _placement_checks):
        checks += checks_of(draft)
    return [check.model_dump() for check in checks]


def findings_of_import(draft: Draft) -> list[str]:
    """Return a finding if files that an imported asset references are missing, so that their content is not in the twin."""
    given = None if draft.payload.given is None else read_import_record(Path(draft.payload.given))
    names = [] if given is None else given.missing_files
    if not names:
        return []
    more = f" and {len(names) - 1} more" if len(names) > 1 else ""
    named = printable_line(names[0], max_characters=80)
    return [f"files that the asset names were not there: {named}{more}; it may lack a part or a colour"]


def _unseen(draft: Draft) -> list[Check]:
    """Return the check for surface not visible in the photo, if the generator states its share."""
    share = draft.field("generation").get("unseen_share") if "generation" in draft.fields else None
    if share is None:
        return []
    message = "share of the surface that the photo does not show: its shape and colours are a guess" if share else ""
    return [Check(name="every_side_seen", passed=not share, value=share, limit=0.0, message=message)]


def photos_checks(draft: Draft) -> list[Check]:
    """Return the check for how many of several photos were used; empty for a single photo."""
    given = len(draft.payload.files)
    if given < 2 or "generation" not in draft.fields:
        return []
    generation = draft.field("generation")
    photos = generation["notes"].get("photos", {"cut_out": 1, "used": 1})
    used, cut_out = photos["used"], photos["cut_out"]
    said = [f"{given - cut_out} of {given} photos could not be cut out"] if cut_out < given else []
    left_out = generation["notes"].get("left_out", [])
    if left_out:
        said.append(
            f"{', '.join(left_out)}: left out, the outline does not go with those of the other photos (another turn, another"
            " thing, a wrong cut-out)"
        )
    elif used < cut_out:
        said.append(
            f"the generator {generation['generator']} takes one photo, the first: the others are not in the mesh"
        )
    passed = not said
    before = draft.payload.photos_given
    said += [] if before is None else [thinned_words(given, before)]
    said += _describe_camera_turns(generation["notes"])
    return [
        Check(name="every_photo_used", passed=passed, value=float(used), limit=float(given), message="; ".join(said))
    ]


def _describe_camera_turns(notes: dict[str, Any]) -> list[str]:
    """Describe the estimated camera turns with their confidence, stated poses, and the camera position found from outlines."""
    said, estimated = [], [view for view in notes.get("views", []) if not view["turn_stated"]]
    if estimated:
        turns = ", ".join(
            f"{view['name']} {'not told' if view['turn_deg'] is None else format(view['turn_deg'], '.0f')}"
            f"{'' if view['colours'] else ', its colours not used'}"
            + (f" (confidence {view['confidence']:.2f})" if "confidence" in view else "")
            for view in estimated
        )
        said.append(f"turns estimated, degrees: {turns}")
    poses = notes.get("poses")
    if poses is not None:
        size = (
            f"the size by their unit, {poses['unit']}"
            if poses["metric"]
            else f"their unit {poses['unit']}: no size by them"
        )
        said.append(f"cameras as {poses['file']} states them, up {poses['up']}, {size}")
    camera = notes.get("camera")
    if camera is not None:
        said.append(
            f"as the outlines tell, the camera stayed {camera['elevation_deg']:.0f} degrees above the thing, its lens"
            f" {camera['focal_of_longer_side']:.1f} longer sides of the picture"
        )
    return said


def rehearsal_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a twin with a stage answered by a rehearsal server; empty for other twins."""
    if not draft.rehearsed:
        return []
    message = f"{rehearsed_words(draft.rehearsed)}; nothing of this twin is to be believed"
    return [Check(name=REHEARSAL, passed=False, value=float(len(draft.rehearsed)), limit=0.0, message=message)]


def rehearsed_words(stages: Iterable[str]) -> str:
    """Describe the stages answered by a rehearsal server."""
    return f"a rehearsal server (manitwin fake), not a model, answered for {', '.join(sorted(stages))}"


def _physical_checks(draft: Draft) -> list[Check]:
    physical = draft.field("physical")
    invented = [name for name in ESTIMATES if physical[name]["source"] == "default"]
    unknown = physical["mass_kg"]["source"] in OF_NO_NAME
    uncertainty, longest = physical["center_of_mass_uncertainty_m"], max(physical["extents_m"])
    return [
        Check(
            name="no_invented_number",
            passed=not invented,
            value=float(len(invented)),
            limit=0.0,
            message=f"no source for {', '.join(invented)}" if invented else "",
        ),
        Check(
            name="category_known",
            passed=not unknown,
            value=draft.field("language")["category"],
            message="no name given that the priors know: intervals are wide; give --name or a name in the manifest"
            if unknown
            else "",
        ),
        Check(
            name="center_of_mass_known",
            passed=uncertainty <= CENTER_OF_MASS_LIMIT * longest,
            value=uncertainty,
            limit=CENTER_OF_MASS_LIMIT * longest,
            message="the centre of mass depends on how the mass is spread inside, which no surface shows",
        ),
    ]


def _examined(draft: Draft) -> list[Check]:
    """Return checks for objections to the annotator's answers, if they were examined."""
    checks = []
    for name, field in (("estimates_agree", "physical_findings"), ("points_agree", "points_findings")):
        findings = draft.field(field)
        if findings is not None:
            checks.append(
                Check(name=name, passed=not findings, value=float(len(findings)), message="; ".join(findings))
            )
    return checks


def _frame_checks(draft: Draft) -> list[Check]:
    """Return the check for functional points without a frame, with the reasons."""
    missing = draft.field("frames_missing")
    framed = sum(point["frame"] is not None for point in draft.field("points")["functional"])
    message = "; ".join(missing)
    return [Check(name="functional_frames", passed=not missing, value=float(framed), message=message)]


def _collision_checks(draft: Draft) -> list[Check]:
    collision = draft.field("collision")
    uncovered, kept = collision["surface_uncovered_max_m"], collision["cavity_kept"]
    checks = [
        Check(
            name="hulls_cover_surface",
            passed=uncovered <= UNCOVERED_LIMIT_M,
            value=uncovered,
            limit=UNCOVERED_LIMIT_M,
            message="largest distance of the surface from the collision hulls, m",
        )
    ]
    if kept is not None:
        checks.append(
            Check(
                name="container_stays_open",
                passed=kept >= CAVITY_LIMIT,
                value=kept,
                limit=CAVITY_LIMIT,
                message="share of the open cavity that the collision hulls keep",
            )
        )
    hole = collision["holes_kept"]
    if hole is not None:
        checks.append(
            Check(
                name="holes_stay_open",
                passed=hole >= HOLE_LIMIT,
                value=hole,
                limit=HOLE_LIMIT,
                message="share of the hole through it, the one they close most, that the collision hulls keep",
            )
        )
    return checks


def point_checks(draft: Draft) -> list[Check]:
    """Return the check for enough successful grasps at every grasp point, with the shortfalls."""
    points = draft.field(GRASP_POINTS)
    said = [
        f"{p['id']} ({p['scenario']}), confidence {p['confidence']:g}: {p['shortfall']}"
        for p in points["grasp"]
        if p["shortfall"]
    ]
    said += [f"{p['id']} ({p['scenario']}) was withdrawn: {p['shortfall']}" for p in points["withdrawn"]]
    least = min(point["verified"] for point in points["grasp"])
    return [Check(name="held_at_points", passed=not said, value=float(least), message="; ".join(said))]


def agreement_checks(grasps: dict[str, Any]) -> list[Check]:
    """Return the check for agreement with a second engine; empty if there was none or no grasp held."""
    second = grasps.get("second_opinion")
    if second is None or second["holds_share"] is None:
        return []
    share = second["holds_share"]
    message = "" if share >= AGREEMENT_LIMIT else f"share of the verified grasps that hold in {second['engine']} too"
    if second["held_tried"] < grasps["verified"]:
        low, high = wilson_interval(round(share * second["held_tried"]), second["held_tried"])
        message += f"{'; ' if message else ''}a sample of {second['held_tried']} of {grasps['verified']}: "
        message += f"{100 * low:.0f} to {100 * high:.0f} % (95 %)"
    return [
        Check(
            name="holds_in_second_engine",
            passed=share >= AGREEMENT_LIMIT,
            value=share,
            limit=AGREEMENT_LIMIT,
            message=message,
        )
    ]


def _grasp_checks(draft: Draft) -> list[Check]:
    grasps = draft.field("grasps")
    return [
        *point_checks(draft),
        *agreement_checks(grasps),
        Check(
            name="grasps_near_points",
            passed=not grasps["association_radius_widened"],
            value=grasps["association_radius_m"],
            limit=0.03,
            message="grasps were taken from farther than 3 cm around the points"
            if grasps["association_radius_widened"]
            else "",
        ),
        Check(
            name="approach_directions",
            passed=grasps["approach_octants"] >= 4,
            message="octants of the approach direction among the verified grasps",
            value=float(grasps["approach_octants"]),
            limit=4.0,
        ),
    ]


def _placement_checks(draft: Draft) -> list[Check]:
    first = draft.field("placements")[0]
    return [Check(name="rests_in_simulation", passed=first["settled"], value=first["probability"])]
