"""Causes for which items were not accepted: equal causes counted, the most frequent one told with its remedy."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from manitwin import errors
from manitwin.cli.console import print_error

if TYPE_CHECKING:
    from manitwin.engine.ledger.progress import Unaccepted, UnacceptedState

REMEDIES = {
    "unreadable": "open the file in the program that made it and save it again: a photo as PNG or JPEG, a mesh as GLB",
    "empty": "export or download the file again",
    "wrong_type": "give a photo or a mesh; `manitwin import` reads assets of other simulators",
    "too_small": "give a larger photo",
    "too_large": "simplify the mesh, reduce the size of its textures, or raise the limits in the configuration (mesh, run)",
    "animated": "save one frame as PNG, or choose a frame with matting.frame in the configuration",
    "no_faces": "export the mesh with faces: points and curves have no surface",
    "not_finite": "export the mesh again: some of its coordinates are not finite numbers",
    "no_object": "photograph the object whole and larger, on a plain surface of another colour",
    "several_objects": "give one object per input: mark it in the photo (--box, or a column box_px), or give each object in a"
    " file of its own",
    "low_confidence_matte": "photograph the whole object on a plain surface of another colour, or give a mask of it (--mask, or a"
    " column mask) or an image with an alpha channel;"
    " if the cutout.webp beside the twin.json is right, build it with `manitwin review cutouts DATASET --accept ID`;"
    " with --draw you redraw the outline in the browser",
    "generator_failed": "give another photo or a mesh, or use another generator (--generator, see docs/generators.md)",
    "not_watertight": "close the holes of the mesh in a modeller",
    "degenerate": "give a mesh that encloses a volume, with walls and no holes",
    "absurd_size": "give the unit of a mesh (--units m, cm or mm, or a column units), or its length (--longest-side 0.12,"
    " metres, or a column longest_side_m)",
    "poor_quality": "give another photo, or use another generator (--generator, see docs/generators.md)",
    "implausible_mass": "check --units, --longest-side and --name, or the columns units, longest_side_m and name",
    "implausible_size": "check --units, --longest-side and --name, or the columns of these; if no unit is right, as with game"
    " assets, give --units none: the mesh is then scaled to the usual size of an object of its name",
    "too_wide": "use a gripper that opens wider (--gripper, see docs/grippers.md)",
    "too_thin": "use a gripper for thin objects, such as a suction cup (--gripper, see docs/grippers.md)",
    "no_proposal": "use another gripper (--gripper, see docs/grippers.md); it is possible that no gripper can reach this object",
    "none_held": "use another gripper (--gripper, see docs/grippers.md); the object may be too heavy or too smooth for this one",
    "no_stable_pose": "none for a round object, which rolls; otherwise check that the mesh is the whole object",
    "unstable": "use fewer --stacked or --contained objects, or a larger layout.repairs in the configuration",
    "no_room": "use fewer --objects, or a sparser --clutter",
    "nothing_fits": "use fewer --stacked or --contained objects, or twins that others can stand on or fit into",
    "crashed": "retry the item; if the worker crashes again, leave this input out and report the crash with its file",
    "timeout": "set a larger run.stage_timeout_s in the configuration",
}
"""What a person can do about a reason: those of twins (``REJECTION_REASONS``), of layouts, and of what failed."""

NAME_IT = (
    "name the object (--name mug, or a column name), and give its length (--longest-side 0.12, metres, or a column"
    " longest_side_m); for a mesh its unit is enough (--units m, cm or mm, or a column units)"
)
"""The remedy where only the usual size of anything made it too wide or too thin."""
SCALE_IT = "give the unit (--units m, cm or mm, or a column units), or scale the mesh in the file"
MEASURE_IT = (
    "measure the object (--longest-side 0.12, metres, or a column longest_side_m), give a mesh of its true size"
    " (--units m, cm or mm, or a column units), or give a more specific name (--name)"
)
"""The remedy where the usual size of what it is called did: another gripper comes after that."""

AS_SCENERY = (
    "none: the object is too large for these grippers; to use it as scenery, load its own file in the simulator, or the shape"
    " in metres that `manitwin import` writes (asset.glb)"
)
"""Of what has the size of such things and is too large to be held."""

LONGEST_MESSAGE = 500  # what a native stack adds is told by status --why

_OWN_ERRORS = "|".join(
    name for name, kind in vars(errors).items() if isinstance(kind, type) and issubclass(kind, errors.ManiTwinError)
)
_TRIES = re.compile(r"^\S+ failed \d+ times: ")
_OWN_ERROR = re.compile(rf"^(?:{_OWN_ERRORS}): ")
_LINE_OF_CODE = re.compile(r" \(\w+\.py:\d+\)$")
_QUOTED = r"(?<!\w)(?:'[^']*'|\"[^\"]*\")(?!\w)"  # an apostrophe begins no quotation
_OF_PLACE = re.compile(r": (?:the box|a mask|no mask) ")
"""What is wrong with is where in a photo the thing is said to be, and not with the photo."""
_SEMICOLON = re.compile(rf"{_QUOTED}|; ")
_VARIES = (
    (re.compile(_QUOTED), "'...'"),
    (re.compile(r"(?:[a-z0-9]+://|\.{0,2}/)\S*[^\s:;,.)]"), "PATH"),
    (re.compile(r"\b[\w.-]+\.(?:[A-Za-z]\w{1,4})\b"), "FILE"),
    (re.compile(r"\b(?=[0-9a-f]*\d)[0-9a-f]{8,64}\b"), "ID"),
    (re.compile(r"\w*\d[\w.]*"), "N"),
)


@dataclass(frozen=True)
class Cause:
    """One cause and how many items it ended; ``example`` is the first of them, ``message`` what was said of it."""

    state: UnacceptedState
    reason: str | None
    count: int
    example: str
    message: str
    remedy: str | None


def group_causes(unaccepted: Iterable[Unaccepted]) -> list[Cause]:
    """Count equal causes, frequent ones first.

    A rejection's cause is its reason, apart where that rests on a size that nobody has said; any other cause is what was
    said, without ids, names, paths and numbers.
    """
    found: dict[tuple[str, str], list[Unaccepted]] = {}
    for item in unaccepted:
        told = _normalize_message(item.message)
        if item.state == "rejected":
            told = f"{item.reason or ''} {_size_remedy(item.message) or ''}"
        found.setdefault((item.state, told), []).append(item)
    groups = sorted(found.values(), key=lambda items: -len(items))
    return [_cause(items[0], len(items)) for items in groups]


def cause_lines(causes: list[Cause], *, again: str, others: str) -> list[str]:
    """Write the most frequent cause of each way to end, with its remedy.

    ``again`` says how to go on once it is mended, ``others`` where the other causes are told.
    """
    lines = []
    for state in dict.fromkeys(cause.state for cause in causes):
        alike = [cause for cause in causes if cause.state == state]
        total, first = sum(cause.count for cause in alike), alike[0]
        lines.append(f"why {state}: {first.count} of {total}{_reason(first)}: {first.message}")
        remedies = [text for text in (first.remedy, again if state == "failed" else None) if text]
        if remedies:
            lines.append(f"  remedy: {'; then '.join(remedies)}")
        if len(alike) > 1:
            lines.append(f"  {len(alike) - 1} other cause{'s' if len(alike) > 2 else ''}: {others}")
    return lines


def _reason(cause: Cause) -> str:
    example = f", such as item {cause.example}" if cause.count > 1 else f", item {cause.example}"
    return f" {cause.reason}{example}" if cause.state == "rejected" else example


def _cause(first: Unaccepted, count: int) -> Cause:
    message, remedy = strip_prefixes(first.message), REMEDIES.get(first.reason or "")
    if remedy is not None and (of_size := _size_remedy(first.message)) is not None:
        remedy = of_size if of_size in (NAME_IT, AS_SCENERY) else f"{of_size}; else {remedy}"
    if first.reason:
        message = message.removeprefix(f"{first.reason}: ")
    if (first.reason == "unreadable" and _OF_PLACE.search(first.message)) or (
        remedy is None and _is_manitwin_error(first.message)
    ):
        message, remedy = _split_remedy(message)
    elif remedy is not None:
        message = message.removesuffix(f"; {remedy}")  # some messages end with the same words
    return Cause(first.state, first.reason, count, first.which, _shortened(message), remedy)


def _size_remedy(message: str) -> str | None:
    """Return the remedy of a rejection that a size decided which is usual, unlikely, or no hand's; None where it is sound."""
    from manitwin.pipeline.guesses import OF_ANYTHING, SIZE_UNSAID
    from manitwin.pipeline.size_remarks import CHECK_SCALE, TRULY_LARGE

    if TRULY_LARGE in message:
        return AS_SCENERY
    if CHECK_SCALE in message:
        return SCALE_IT
    if SIZE_UNSAID not in message:
        return None
    return NAME_IT if OF_ANYTHING in message else MEASURE_IT


def strip_prefixes(message: str) -> str:
    """Return what was said without the stage and the attempts, the class of our own errors and the line of code."""
    return _LINE_OF_CODE.sub("", _OWN_ERROR.sub("", _TRIES.sub("", message)))


def _is_manitwin_error(message: str) -> bool:
    return _OWN_ERROR.match(_TRIES.sub("", message)) is not None


def _split_remedy(message: str) -> tuple[str, str | None]:
    """Split a message of our own errors, which ends with its remedy where it has one; a semicolon in quotes is none."""
    ends = [found.start() for found in _SEMICOLON.finditer(message) if found[0] == "; "]
    return (message[: ends[-1]], message[ends[-1] + 2 :]) if ends else (message, None)


def _shortened(message: str) -> str:
    return message if len(message) <= LONGEST_MESSAGE else f"{message[:LONGEST_MESSAGE]} ..."


def _normalize_message(message: str) -> str:
    told = _shortened(strip_prefixes(message))
    for pattern, stand_in in _VARIES:
        told = pattern.sub(stand_in, told)
    return told


def print_causes(place: str, numbers: Collection[int] = (), told: bool = False) -> None:
    """Print the most frequent causes that the ledger below a folder or URL tells of, with their remedies.

    ``numbers`` are the items that are meant, none: all. ``told``: the first cause stands in the line above already.
    """
    again, others = f"manitwin retry {place} and the same command again", f"manitwin status {place}"
    for line in cause_lines(read_causes(place, numbers), again=again, others=others)[1 if told else 0 :]:
        print_error(line.strip() if told else line)


def read_causes(place: str, numbers: Collection[int] = ()) -> list[Cause]:
    """Return why items below a folder or URL were not accepted, the most frequent cause first; ``numbers`` empty: all items."""
    from manitwin.engine.ledger.location import local_ledger
    from manitwin.engine.ledger.progress import read_unaccepted
    from manitwin.engine.ledger.reading import read_ledger
    from manitwin.twin.dataset_root import DatasetRoot

    wanted = {str(number) for number in numbers}
    with read_ledger(local_ledger(DatasetRoot(place))) as ledger:
        return group_causes(each for each in read_unaccepted(ledger) if not wanted or each.which in wanted)
