"""Findings about a twin that do not reject it: shown, counted, filterable (paper, "Failure Cases and Filtering")."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, cast

from manitwin.engine.stage import Draft
from manitwin.models.annotators.likely_names import OF_LIKELY_NAMES
from manitwin.pipeline.grasps import GRASP_POINTS
from manitwin.twin.record_values import Check
from manitwin.twin.shares import wilson_interval

UNCOVERED_LIMIT_M = 0.002
"""Of the surface that no collision hull covers: more would let fingers sink in (measured on real meshes: docs/measured.md)."""

CAVITY_LIMIT = 0.8
"""Of the open cavity that the hulls keep: less, and a container holds visibly less than it shows."""

AGREEMENT_LIMIT = 0.9
"""Of the verified grasps that a second engine holds: below it, the two disagree about the object and not about single grasps."""

CENTER_OF_MASS_LIMIT = 0.1
"""Of the longest side: an uncertainty beyond it decides whether a grasp holds."""

REHEARSAL = "rehearsal"
"""The check that only fails, and is only there, where a rehearsal server stood in for a model."""

PRIOR = "prior:"
UNKNOWN = f"{PRIOR}unknown"
"""The source of what is only usual of anything."""
OF_NO_NAME = frozenset({UNKNOWN, OF_LIKELY_NAMES})
"""The sources of what rests on no name: of anything, or of the names that a thing may have."""

SIZE_UNSAID = "nobody says how large it is"
"""What a rejection's detail says where the size is only a usual one; remedies go by it."""
OF_ANYTHING = "usual of anything"
"""What it says besides where nobody has named the thing either."""
LIKE_IT = " that looks like it"

ESTIMATES = ("mass_kg", "friction_static", "friction_dynamic", "restitution")


def quality_checks(draft: Draft) -> list[dict[str, Any]]:
    """Collect the gate's checks and the findings of the later stages, in the order of the stages."""
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
    checks += _unseen(draft)
    checks += filled_checks(draft)
    checks += photos_checks(draft)
    findings = draft.field("geometry")["findings"]
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


def naming_checks(draft: Draft) -> list[Check]:
    """Return what a thing is taken for that nobody has named, by a model or a classifier: a finding, unless one is sure.

    None for others.
    """
    naming = draft.fields.get("naming")
    if naming is None:
        return []
    filled, known = filled_in(draft), (draft.fields.get("generation") or {}).get("known")
    if filled is not None and filled["category"] is not None and known is not None:
        message = f"{filled['source']} takes it for a {known['name']}; --name overrules it"
        return [Check(name="named", passed=True, value=str(known["name"]), message=message)]
    value, source = naming["probability"]["value"], naming["probability"]["source"]
    if naming["name"] is not None:
        message = f"{source} takes it for a {naming['name']} ({likeliest_words(naming)}); --name overrules it"
    else:
        message = f"{source} cannot tell what it is ({likeliest_words(naming)}); say it with --name"
    return [Check(name="named", passed=naming["name"] is not None, value=value, message=message)]


def size_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a size that is only what is usual of anything; none where somebody said it or what it is."""
    size = draft.fields.get("size")
    if size is None or size["source"] not in OF_NO_NAME:
        return []
    message = f"{SIZE_UNSAID}: {unknown_size_words(size)}, and its mass is for that size; say what it is with --name"
    return [Check(name="size_known", passed=False, value=size["value"], message=message)]


def unknown_size_words(size: dict[str, Any]) -> str:
    """Say of a size that only a prior gives: '15 cm is what is usual of anything (2 to 60 cm)', or '... of a mug'."""
    value, low, high = (f"{100 * size[key]:.3g}" for key in ("value", "low", "high"))
    category = size["source"].removeprefix(PRIOR)
    usual = {UNKNOWN: OF_ANYTHING, OF_LIKELY_NAMES: OF_ANYTHING + LIKE_IT}.get(
        size["source"], f"usual of {'an' if category[0] in 'aeiou' else 'a'} {category}"
    )
    return f"{value} cm is what is {usual} ({low} to {high} cm)"


def unsaid_size_words(draft: Draft) -> str | None:
    """Say that a size is only what is usual of such things, so that nobody has said it; None where somebody has."""
    size = draft.fields.get("size")
    if size is None or not size["source"].startswith(PRIOR):
        return None
    return f"{SIZE_UNSAID}: {unknown_size_words(size)}"


def likeliest_words(naming: dict[str, Any]) -> str:
    """Say the likeliest names with their probabilities: 'orange 41 %, lemon 12 %, apple 3 %'."""
    return ", ".join(f"{guess['name']} {100 * guess['probability']:.0f} %" for guess in naming["likeliest"])


def _unseen(draft: Draft) -> list[Check]:
    """Return what the photo did not show, where the generator says how much of the surface that is."""
    share = draft.field("generation").get("unseen_share") if "generation" in draft.fields else None
    if share is None:
        return []
    message = "share of the surface that the photo does not show: its shape and colours are a guess" if share else ""
    return [Check(name="every_side_seen", passed=not share, value=share, limit=0.0, message=message)]


def filled_in(draft: Draft) -> dict[str, Any] | None:
    """Return the note of what a model filled in; None where none was asked."""
    generation = draft.fields.get("generation") or {}
    return cast(dict[str, Any] | None, generation.get("notes", {}).get("filled"))


def filled_checks(draft: Draft) -> list[Check]:
    """Return what a model said of the template that a thing was made of; none where no model was asked."""
    filled = filled_in(draft)
    if filled is None:
        return []
    said = [] if filled["category"] is None else [f"{filled['source']} filled in the template {filled['category']}"]
    message = "; ".join([*said, *filled["findings"]])
    return [Check(name="template_filled", passed=not filled["findings"], value=filled["category"], message=message)]


def photos_checks(draft: Draft) -> list[Check]:
    """Return of several photos how many the mesh was made of; none for a single one."""
    given = len(draft.payload.files)
    if given < 2 or "generation" not in draft.fields:
        return []
    generation = draft.field("generation")
    photos = generation["notes"].get("photos", {"cut_out": 1, "used": 1})
    used, cut_out = photos["used"], photos["cut_out"]
    said = [f"{given - cut_out} of {given} photos could not be cut out"] if cut_out < given else []
    if used < cut_out:
        said.append(
            f"the generator {generation['generator']} takes one photo, the first: the others are not in the mesh"
        )
    value = float(used)
    return [Check(name="every_photo_used", passed=not said, value=value, limit=float(given), message="; ".join(said))]


def rehearsal_checks(draft: Draft) -> list[Check]:
    """Return the failed check of a twin that a rehearsal server had a part in; none for all others."""
    if not draft.rehearsed:
        return []
    message = f"{rehearsed_words(draft.rehearsed)}; nothing of this twin is to be believed"
    return [Check(name=REHEARSAL, passed=False, value=float(len(draft.rehearsed)), limit=0.0, message=message)]


def rehearsed_words(stages: Iterable[str]) -> str:
    """Say which stages a rehearsal server answered for."""
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
    """Return what spoke against the answers of an annotator that were examined."""
    checks = []
    for name, field in (("estimates_agree", "physical_findings"), ("points_agree", "points_findings")):
        findings = draft.field(field)
        if findings is not None:
            checks.append(
                Check(name=name, passed=not findings, value=float(len(findings)), message="; ".join(findings))
            )
    return checks


def _frame_checks(draft: Draft) -> list[Check]:
    """Return which functional points have no frame, and why."""
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
    return checks


def point_checks(draft: Draft) -> list[Check]:
    """Return whether enough grasps hold at every grasp point, and what was said of those where they do not."""
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
    """Return whether a second engine holds what the first one does; none where no other was asked or nothing held."""
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
