"""Rule-based answers to the annotator's questions in place of a vision-language model, for rehearsals.

The object's name is parsed from the question, its properties come from the priors, its proportions and colours from the pictures.
Marked points are chosen by the values that the question lists for them. Equal questions get equal answers.
"""

from __future__ import annotations

import io
import re
from typing import Any

import numpy as np
from PIL import Image

from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Interval, Prior
from manitwin.models.annotators.priors import unknown_prior
from manitwin.models.fakes.picture_proportions import foreground, measure_proportions

ASKED_AGAIN = "It contradicts what is known"
"""The annotator's phrase in a repeated question."""

_NAME = re.compile(r"(?:The user calls it|it was recognised as): (.+?)\.(?:\s|$)")
_VIEW = re.compile(r"azimuth (-?\d+), elevation (-?\d+)")
_SIZE = re.compile(r"(?:measured size is|not measured: about) ([\d. x]+ cm)")
_MATERIAL = re.compile(r"material was estimated as (.+?)\.(?:\s|$)")
_LISTED = re.compile(r"\b(\d+): (\d+) mm(?:, (\d+) mm, (?:\d+ mm|unknown))?(?=[;.])")
_BOX = re.compile(r"as it stands, has 1 : ([\d.]+) : ([\d.]+)")
_DENSITY = re.compile(r"is ([\d.e+-]+) kg/m3, but a thing of .* has ([\d.e+-]+) to ([\d.e+-]+) kg/m3")
_ASKED_FOR = re.compile(r"somebody asks for (['\"])(.+?)\1\.(?:\s|$)")
_TOO_WIDE = re.compile(r"marker (\d+), .*fingers")
_ONE_MATTER = ("food skin", "foam", "wax", "wood")  # surfaces of solid objects, not of containers with contents
_USUAL_WALL_M = 0.003


def rehearsal_answer(schema_name: str, schema: dict[str, Any], text: str, pngs: list[bytes]) -> dict[str, Any]:
    """Answer a question, given its schema's name, its whole text and pictures; unknown schemas get a minimal valid value."""
    found = _NAME.search(text)
    prior = find_prior(found.group(1)) if found else None
    if schema_name == "quality":
        return _quality(prior or unknown_prior(), beside_photo="like_photo" in schema["properties"])
    if schema_name == "physical":
        matters = schema["properties"]["materials"]["items"]["properties"]["material"]["enum"]
        answer = _physical(prior or unknown_prior(), found is not None, text, pngs, matters)
        return _corrected(answer, prior or unknown_prior(), text.partition(ASKED_AGAIN)[2])
    if schema_name == "captions":
        return _captions(prior or unknown_prior(), found is not None, text, pngs)
    if schema_name in ("functional_points", "grasp_points"):
        return _points(schema_name, schema, text, prior or unknown_prior())
    if schema_name == "template":
        return _template(schema, found.group(1) if found else None, text)
    if schema_name in ("template_measures", "template_likeness"):
        return _confirmed_template(schema_name, schema)
    if schema_name == "probe":
        return {"color": _color(pngs)}
    answer = _minimal_value(schema)
    assert isinstance(answer, dict)
    return answer


def _quality(prior: Prior, *, beside_photo: bool) -> dict[str, Any]:
    clean = {"evidence": "nothing seen", "severity": "none"}
    return {
        "shown": f"One {prior.category}.",
        "objects_evidence": "one connected thing in all views",
        "single_object": "yes",
        "fragmentation": clean,
        "texture_corruption": clean,
        "geometric_implausibility": clean,
        "quality_evidence": "no artifact in any view",
        "visual_quality": "yes",
        **({"photo_evidence": "nothing is missing", "like_photo": "yes"} if beside_photo else {}),
    }


def _physical(prior: Prior, named: bool, text: str, pngs: list[bytes], matters: list[str]) -> dict[str, Any]:
    views = [(float(azimuth), float(elevation)) for azimuth, elevation in _VIEW.findall(text)]
    shares = measure_proportions(pngs, views)
    longest = prior.longest_axis_m
    structure, wall_m = _structure(prior)
    return {
        "shown": f"One {prior.category}.",
        "object": prior.category,
        "same_as_named": "yes" if named else "no name given",
        "materials": [{"part": "all", "material": matter} for matter in _matters(prior, matters)],
        "material": prior.material,
        "size_rationale": f"usual size of a {prior.category}, proportions as seen",
        **{
            side: _interval(longest, share)
            for side, share in zip(("length_m", "width_m", "height_m"), shares, strict=True)
        },
        "structure": structure,
        "wall_thickness_m": wall_m,
        "mass_rationale": f"usual mass of a {prior.category}",
        "mass_kg": _interval(prior.mass_kg),
        "friction_rationale": f"surface of {prior.surface}",
        "friction_static": _interval(prior.friction_static),
        "friction_dynamic": _interval(prior.friction_dynamic),
        "restitution": _interval(prior.restitution),
    }


def _corrected(answer: dict[str, Any], prior: Prior, findings: str) -> dict[str, Any]:
    """Return the answer corrected by the findings: measured proportions, and a mass consistent with the material's density."""
    if box := _BOX.search(findings):
        for side, share in (("width_m", float(box.group(1))), ("height_m", float(box.group(2)))):
            answer[side] = {key: float(f"{value * share:.4g}") for key, value in answer["length_m"].items()}
    if dense := _DENSITY.search(findings):
        density, low, high = (float(value) for value in dense.groups())
        factor = max(low, 1e-9) * 1.25 / density if density < low else 0.8 * high / density
        mass = min(max(answer["mass_kg"]["typical"] * factor, prior.mass_kg.low), prior.mass_kg.high)
        answer["mass_kg"]["typical"] = float(f"{mass:.4g}")
    return answer


def _matters(prior: Prior, known: list[str]) -> list[str]:
    """Return the surface material and those named by the prior, at most four."""
    first = prior.surface if prior.surface in known else "other"
    named = [matter for matter in known if re.search(rf"\b{matter}\b", prior.material)]
    return list(dict.fromkeys([first, *named]))[:4]


def _structure(prior: Prior) -> tuple[str, float]:
    if prior.mass_distribution == "shell":
        return "hollow_closed", prior.wall_thickness_m or _USUAL_WALL_M
    if prior.mass_distribution == "full":
        return ("solid", 0.0) if prior.surface in _ONE_MATTER else ("full_closed", 0.0)
    return ("open_container", _USUAL_WALL_M) if prior.container else ("solid", 0.0)


def _interval(of: Interval, factor: float = 1.0) -> dict[str, float]:
    return {key: float(f"{value * factor:.4g}") for key, value in of.model_dump().items()}


def _captions(prior: Prior, named: bool, text: str, pngs: list[bytes]) -> dict[str, Any]:
    noun = "object" if prior.category == "unknown" else prior.category
    color, size, material = _color(pngs), _SIZE.search(text), _MATERIAL.search(text)
    extents = size.group(1) if size else "unknown size"
    matter = material.group(1) if material else prior.material
    return {
        "shown": f"One {color} {noun}.",
        "same_as_named": "yes" if named else "no name given",
        "category": noun,
        "color": color,
        "material": matter,
        "size": extents,
        "shape": prior.shape,
        "function": prior.function,
        "caption": f"A {color} {noun} of {matter}, for {prior.function}.",
        "label": f"{color} {noun}",
        "sentence": f"This {noun} is {color} all over and {prior.shape}.",
        "detailed": (
            f"The whole {noun} is {color}, with no part that stands out by another color. It is {prior.shape}, and what it is"
            f" made of is {matter}. People keep such things at hand for {prior.function}."
        ),
        "by_use": f"One takes it for {prior.function}.",
        "by_look": f"Something {color}, {prior.shape}.",
        "by_size": f"It measures {extents} and consists of {matter}.",
        "request": f"Please bring me the {color} {noun}.",
    }


def _points(schema_name: str, schema: dict[str, Any], text: str, prior: Prior) -> dict[str, Any]:
    ids = schema["properties"]["points"]["items"]["properties"]["id"]["enum"]
    listed = {
        number: (int(first), int(second or 0)) for number, first, second in _LISTED.findall(text) if number in ids
    }
    listed = listed or dict.fromkeys(ids, (0, 0))
    points = _functional(listed, prior) if schema_name == "functional_points" else _grasps(listed, prior, text)
    return {"shown": f"One {prior.category}.", "points": points}


def _functional(listed: dict[str, tuple[int, int]], prior: Prior) -> list[dict[str, Any]]:
    """Return the highest and the lowest candidate as functional points."""
    order = sorted(listed, key=lambda number: (listed[number][0], int(number)))
    places = ((order[-1], "upper end", "what one reaches first"), (order[0], "underside", "what it rests on"))
    return [
        {
            "rationale": f"the {label} of the {prior.category}",
            "label": label,
            "description": description,
            "id": number,
            "confidence": 0.7,
        }
        for number, label, description in places
    ]


def _grasps(listed: dict[str, tuple[int, int]], prior: Prior, text: str) -> list[dict[str, Any]]:
    """Return the candidate nearest to the centre of gravity, and the nearest one at a different height."""
    order = sorted(listed, key=lambda number: (*listed[number], int(number)))
    heights = [height for _, height in listed.values()]
    apart = 0.2 * (max(heights) - min(heights))
    first = order[0]
    others = [number for number in order[1:] if abs(listed[number][1] - listed[first][1]) > apart] or order[1:]
    too_wide = set(_TOO_WIDE.findall(text)) if ASKED_AGAIN in text else set()
    return [
        {
            "rationale": "near the center of gravity, so that it does not turn when it is lifted",
            "label": "body",
            "id": number,
            "type": "power" if number in too_wide else "parallel_jaw",
            "scenario": scenario,
            "confidence": confidence,
        }
        for number, scenario, confidence in (
            (first, f"pick up the {prior.category}", 0.8),
            (others[0], f"hand over the {prior.category}", 0.6),
        )
    ]


def _template(schema: dict[str, Any], name: str | None, text: str) -> dict[str, Any]:
    """Return the template that matches the object's name or the last matching words of a request; the last category otherwise."""
    categories = schema["properties"]["category"]["enum"]
    asked = _ASKED_FOR.search(text)
    words = (asked.group(2) if asked else name or "").lower().split()
    phrases = [" ".join(words[start:end]) for end in range(len(words), 0, -1) for start in range(end)]
    called = [phrase for phrase in phrases if phrase in categories]
    called += [prior.category for phrase in phrases if (prior := find_prior(phrase)) and prior.category in categories]
    return {"shown": f"One {called[0] if called else 'thing'}.", "category": called[0] if called else categories[-1]}


def _confirmed_template(schema_name: str, schema: dict[str, Any]) -> dict[str, Any]:
    """Return an answer that confirms a template's usual measures and appearance."""
    first = schema_name == "template_measures"
    measures = dict.fromkeys(schema["properties"]["measures" if first else "corrected"]["properties"])
    if first:
        return {"shown": "It is as such things are.", "measures": measures, "looks": []}
    return {"shown": "Both show the same thing.", "differences": [], "right": "yes", "corrected": measures, "looks": []}


def _color(pngs: list[bytes]) -> str:
    """Return a basic colour word for the median foreground colour of the first picture."""
    if not pngs:
        return "grey"
    picture = np.asarray(Image.open(io.BytesIO(pngs[0])).convert("RGB"))
    seen = foreground(picture)
    red, green, blue = (
        float(v) / 255 for v in np.median(picture[seen] if seen.any() else picture.reshape(-1, 3), axis=0)
    )
    high, low = max(red, green, blue), min(red, green, blue)
    if high - low < 0.12:
        return "black" if high < 0.25 else "white" if low > 0.8 else "grey"
    if high == red:
        return "red" if green - blue < 0.25 * (high - low) + 0.1 else "yellow" if green > 0.7 * red else "brown"
    return "green" if high == green else "blue"


def _minimal_value(schema: dict[str, Any]) -> Any:
    """Return a minimal value that satisfies a schema."""
    if "enum" in schema:
        return schema["enum"][0]
    if "anyOf" in schema:
        return _minimal_value(schema["anyOf"][0])
    kind = schema.get("type")
    if kind == "object":
        return {name: _minimal_value(part) for name, part in schema.get("properties", {}).items()}
    if kind == "array":
        return [_minimal_value(schema["items"])]
    return {"string": "nothing", "number": 0.0, "integer": 0, "boolean": False}.get(str(kind))
