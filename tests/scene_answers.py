"""Answers of questions about scenes, each found anew from what ``second_scene`` reads of a scene."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.distance import pdist

from second_scene import COUNTER, SecondScene, SecondView, color_said

LITTLE = set(re.findall(r"\w+", "and or such as of on to a the with for from it up things"))


def _best_grasp(record: dict[str, Any]) -> str:
    return str(max(record["points"]["grasp"], key=lambda point: point["confidence"])["type"])


GRASPS = {
    "parallel-jaw": "parallel_jaw",
    "pinch": "pinch",
    "power": "power",
    "three-finger": "three_finger",
    "enveloping": "enveloping",
}
_WAY = (
    r"(to the (?:right|left) as seen in the picture|straight (?:towards|away from) the (?:camera|robot)"
    r"|straight towards the (?:lower|upper) edge of the picture|to the robot's (?:right|left))"
)


def rederived(question: dict[str, Any], view: SecondView) -> bool:
    """Whether a question's references are unique and its answer is the one found anew."""
    scene, called = view.scene, question["evidence"]["called"]
    for name, words in called.items():
        if (words in question["question"] or words in question["options"]) and view.meant(words) != [name]:
            return False
    text, asked = question["question"].lower(), []
    for name, words in sorted(called.items(), key=lambda item: -len(item[1])):  # "the can opener" before "the can"
        if words in text:
            asked.append((text.index(words), name))
            text = text.replace(words, "#" * len(words))
    return _CHECKS[question["family"]](question, view, scene, [name for _, name in sorted(asked)])


def _option_objects(question: dict[str, Any], view: SecondView) -> dict[str, str | None]:
    return {option: view.object_at(question["points"][int(option[2:-1])]) for option in question["options"]}


def _point(q, v, s, asked):
    return v.object_at(q["points"][0]) == asked[0]


def _at_point(q, v, s, asked):
    there = v.object_at(q["points"][0])
    return [option for option in q["options"] if v.meant(option) == [there]] == [q["answer"]]


def _by_color(q, v, s, asked):
    colors = {option: color_said(s.records[name]) for option, name in _option_objects(q, v).items()}
    right = colors.pop(q["answer"])
    return right in q["question"] and all(right.split()[-1] != other.split()[-1] for other in colors.values())


def _region(q, v, s, asked):
    rows, columns = np.nonzero(v.mask(asked[0]))
    vertical, horizontal = q["answer"].split()
    return bool((rows < v.height / 2).all() if vertical == "top" else (rows >= v.height / 2).all()) and bool(
        (columns < v.width / 2).all() if horizontal == "left" else (columns >= v.width / 2).all()
    )


def _grasp_said(text: str) -> str:
    return next(kind for words, kind in GRASPS.items() if words in text)


def _locate(q, v, s, asked):
    return _point(q, v, s, asked) and _grasp_said(q["answer"]) == _best_grasp(s.records[asked[0]])


def _touch(q, v, s, asked):
    part = s.facts["parts"][str(v.parts[v.at(q["points"][0])])]
    return part["object"] == asked[0] and re.search(rf"\b(the|its) {part['name']}\b", q["question"]) is not None


def _part_visible(q, v, s, asked):
    number = next(
        n for n, p in s.facts["parts"].items() if p["object"] == asked[0] and f"the {p['name']} of" in q["question"]
    )
    count = int((v.parts == int(number)).sum())
    return count >= 100 * v.scale if q["answer"] == "yes" else count <= 2 * v.scale


def _interaction(q, v, s, asked):
    name = asked[0]
    point = next(p for p in s.records[name]["points"]["functional"] if f"the {p['label']} of" in q["question"])
    pose = s.pose(name)
    opens = point["label"] in ("opening", "mouth")
    place = point["frame"]["position_m"] if opens else point["position_m"]
    x, y, depth = v.projected((pose[:3, :3] @ place + pose[:3, 3])[None])[0]
    there, seen = v.ids[int(y), int(x)], v.depth[int(y), int(x)]
    if v.at(q["points"][0]) != (int(y), int(x)):
        return False
    if q["answer"] == "no":
        return there == s.ids[name] and seen > depth - 0.008 and (opens or seen < depth + 0.008)
    return there == s.ids[q["evidence"]["hidden_by"]] != s.ids[name] and seen < depth - 0.01


def _function(q, v, s, asked):
    functions = {option: s.records[name]["language"]["function"] for option, name in _option_objects(q, v).items()}
    right = functions.pop(q["answer"])
    words = set(re.findall(r"\w+", right)) - LITTLE
    return right in q["question"] and all(
        not words & (set(re.findall(r"\w+", each)) - LITTLE) for each in functions.values()
    )


def _grasp_type(q, v, s, asked):
    return _grasp_said(q["answer"]) == _best_grasp(s.records[v.object_at(q["points"][0])])


def _pair(q, asked):
    return asked[::-1] if "On which side of" in q["question"] or "on which side of" in q["question"] else asked


def _middle(s: SecondScene, name: str) -> np.ndarray:
    corners = s.corners(name)
    return (corners.min(0) + corners.max(0)) / 2


def _side_robot(q, v, s, asked):
    a, b = _pair(q, asked)
    left = _middle(s, a)[1] - _middle(s, b)[1]
    up_is_ahead = v.to_world[0, 1] > 0  # of the picture, in the robot's frame
    said_ahead = "same way as the camera" in q["question"] or "faces its upper edge" in q["question"]
    said_back = "faces the camera" in q["question"] or "faces its lower edge" in q["question"]
    return (said_ahead if up_is_ahead else said_back) and q["answer"] == ("left" if left > 0 else "right")


def _side_picture(q, v, s, asked):
    a, b = _pair(q, asked)
    columns = [np.nonzero(v.mask(name))[1].mean() for name in (a, b)]
    return ("picture" in q["question"] or "camera" in q["question"]) and q["answer"] == (
        "left" if columns[0] < columns[1] else "right"
    )


def _gap(q, v, s, asked):
    measured, corners = q["evidence"]["measured"], s.corners(q["evidence"]["measured"])
    said = re.match(r"The (.+) is (\d+) cm between its two farthest points\. ", q["question"])
    farthest_m = pdist(trimesh.convex.convex_hull(corners).vertices).max()
    if v.meant(said[1]) != [measured] or abs(int(said[2]) / 100 - farthest_m) > max(0.006, 0.02 * farthest_m):
        return False
    return abs(s.gap(*asked) - float(q["answer"].split()[0]) / 100) < 0.0015


def _nearest(q, v, s, asked):
    gaps = {name: s.gap(asked[0], name) for name in s.objects if name != asked[0]}
    return v.meant(q["answer"]) == [min(gaps, key=lambda name: gaps[name])]


def _legs(q, v) -> list[tuple[np.ndarray, float]]:
    ways = [v.direction(words) for words in re.findall(_WAY, q["question"])]
    lengths = [int(cm) / 100 for cm in re.findall(r"(\d+) cm", q["question"])]
    return list(zip(ways, lengths, strict=True))


def _clearance(q, v, s, asked):
    return (s.slide(asked[0], _legs(q, v)) is None) == (q["answer"] == "yes")


def _grasp_and_clearance(q, v, s, asked):
    kind = _grasp_said(q["question"])
    found = [name for name in v.shown if _best_grasp(s.records[name]) == kind]
    return len(found) == 1 and _clearance(q, v, s, found)


def _slide(q, v, s, asked):
    touched = s.slide(asked[0], _legs(q, v))
    return (touched is not None) == (q["answer"] == "yes") and touched == q["evidence"]["met"]


def _slide_hits(q, v, s, asked):
    return [s.slide(asked[0], _legs(q, v))] == v.meant(q["answer"])


def _blocked(q, v, s, asked):
    length = int(re.search(r"(\d+) cm", q["question"])[1]) / 100
    hit = [words for words in q["options"] if s.slide(asked[0], [(v.direction(words), length)]) is not None]
    return hit == [q["answer"]]


def _taller(q, v, s, asked):
    tops = {option: s.corners(name)[:, 2].max() for option, name in _option_objects(q, v).items()}
    return max(tops, key=lambda option: tops[option]) == q["answer"]


def _heavier(q, v, s, asked):
    masses = {option: s.records[name]["physical"]["mass_kg"] for option, name in _option_objects(q, v).items()}
    right = masses.pop(q["answer"])
    return all(right["low"] > other["high"] for other in masses.values())


def _occluder(q, v, s, asked):
    mesh = trimesh.load(s.twins[asked[0]] / "visual.glb", force="mesh")
    turned = np.asarray(mesh.vertices)[:, [0, 2, 1]] * [1, -1, 1]  # glTF is Y-up
    pose = s.pose(asked[0])
    x, y, depth = v.projected(turned @ pose[:3, :3].T + pose[:3, 3]).T
    inside = (x >= 0) & (y >= 0) & (x < v.width) & (y < v.height)
    rows, columns = y[inside].astype(int), x[inside].astype(int)
    hidden = (v.ids[rows, columns] != s.ids[asked[0]]) & (v.depth[rows, columns] < depth[inside] - 0.005)
    hiding = Counter(v.ids[rows[hidden], columns[hidden]].tolist())
    numbers = {number: name for name, number in s.ids.items()}
    return v.meant(q["answer"]) == [numbers[hiding.most_common(1)[0][0]]]


def _box(q, v, s, asked):
    rows, columns = np.nonzero(v.mask(asked[0]))
    box = [columns.min() / v.width, rows.min() / v.height, np.ptp(columns) + 1, np.ptp(rows) + 1]
    return np.allclose(q["boxes"][0], [box[0], box[1], box[2] / v.width, box[3] / v.height], atol=1e-9)


def _count(q, v, s, asked):
    return len(v.shown) == int(q["answer"]) and q["options"].count(q["answer"]) == 1


def _is_there(q, v, s, asked):
    present = {s.objects[name]["category"] for name in v.shown}
    ends = r"(?:\?| in this| among)"
    said = [c for c in present if re.search(rf"\ban? (?:{COUNTER.pattern})?{re.escape(c)}{ends}", q["question"])]
    return bool(said) == (q["answer"] == "yes")


def _list(q, v, s, asked):
    order = sorted(v.shown, key=lambda name: np.nonzero(v.mask(name))[1].mean())
    return q["answer"] == ", ".join(s.objects[name]["category"] for name in order)


def _containers(q, v, s, asked):
    order = sorted(v.shown, key=lambda name: np.nonzero(v.mask(name))[1].mean())
    kinds = [s.objects[name]["category"] for name in order]
    return q["answer"] == ", ".join(c for c in kinds if f"{c.split()[-1]}s" in q["question"])


_CHECKS = {
    "point_at_object": _point, "object_at_point": _at_point, "object_by_color": _by_color, "region_of_object": _region,
    "locate_and_grasp": _locate, "touch_point": _touch, "interaction_point_occluded": _interaction,
    "part_visible": _part_visible, "object_for_function": _function, "best_grasp_type": _grasp_type,
    "side_for_robot": _side_robot, "side_in_picture": _side_picture, "gap": _gap, "nearest_object": _nearest,
    "clearance": _clearance, "grasp_and_clearance": _grasp_and_clearance, "taller": _taller, "occluder": _occluder,
    "slide": _slide, "slide_two_legs": _slide, "slide_hits": _slide_hits, "blocked_direction": _blocked,
    "heavier": _heavier, "box_of_object": _box, "count_objects": _count, "is_there": _is_there, "list_objects": _list,
    "list_containers": _containers,
}  # fmt: skip
