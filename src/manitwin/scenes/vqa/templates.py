"""Templates of the questions: the category and paraphrases of each family; the last paraphrase is held out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from manitwin.scenes.vqa.question import DETECTION, FUNCTION, LANGUAGE, SCENE, TASK


@dataclass(frozen=True)
class Family:
    """A kind of question; only the split ``val`` uses the last of its ``paraphrases``."""

    category: str
    paraphrases: tuple[str, ...]


FAMILIES: Mapping[str, Family] = {
    "point_at_object": Family(LANGUAGE, (
        "Point at {a}.",
        "Locate {a} in the picture.",
        "Give a point that lies on {a}.",
        "Where in the picture is {a}? Mark it with one point.",
    )),
    "object_at_point": Family(LANGUAGE, (
        "Which object is at {p}?",
        "What is the object at {p}?",
        "Name the thing that is seen at {p}.",
        "The point {p} lies on one of the objects; on which?",
    )),
    "object_by_color": Family(LANGUAGE, (
        "Which of the marked objects is {color}?",
        "One of the marked objects is {color}; at which point?",
        "Find the {color} object among the marked ones.",
        "At which of the points is the object that is {color}?",
    )),
    "region_of_object": Family(LANGUAGE, (
        "In which part of the picture is {a}?",
        "Which part of the picture holds {a}?",
        "Where in the picture is {a}?",
        "Looking for {a}: which part of the picture should be searched?",
    )),
    "locate_and_grasp": Family(LANGUAGE, (
        "Locate {a} and describe its best grasp type.",
        "Where is {a}, and which type of grasp suits it best?",
        "Find {a} and say how a robot should best grasp it.",
        "Say where {a} is and name the grasp type to use on it.",
    )),
    "touch_point": Family(FUNCTION, (
        "The robot has to touch the {part} of {a}. At which point?",
        "Point at the {part} of {a}.",
        "Give a point on the {part} of {a}.",
        "Mark the {part} of {a} with one point.",
    )),
    "interaction_point_occluded": Family(FUNCTION, (
        "Where is the interaction point at the {part} of {a}, and does another object hide it from this camera?",
        "Does another object cover the interaction point at the {part} of {a} in this picture?",
        "Is the interaction point at the {part} of {a} occluded by another object?",
        "Seen from this camera, is something in front of the interaction point at the {part} of {a}?",
    )),
    "part_visible": Family(FUNCTION, (
        "Can the {part} of {a} be seen in this picture?",
        "Does this camera see the {part} of {a}?",
        "Does the picture show the {part} of {a}?",
        "Is any of the {part} of {a} in view?",
    )),
    "object_for_function": Family(FUNCTION, (
        "Which of the marked objects is made for {function}?",
        "A robot needs something for {function}. Which marked object does it take?",
        "Which marked object serves for {function}?",
        "For {function}, which of the marked objects should be picked up?",
    )),
    "best_grasp_type": Family(FUNCTION, (
        "Which grasp type suits the object at {p} best?",
        "How should a robot hand grasp the object at {p}?",
        "What is the best grasp type for the object at {p}?",
        "Choose the type of grasp for the object at {p}.",
    )),
    "side_for_robot": Family(SCENE, (
        "{robot}From the robot's point of view, is {a} to the left or to the right of {b}?",
        "{robot}On which side of {b} is {a}, as the robot sees them?",
        "{robot}In the robot's own frame, is {a} left or right of {b}?",
        "{robot}Does the robot have {a} to the left or to the right of {b}?",
    )),
    "side_in_picture": Family(SCENE, (
        "In this picture, is {a} to the left or to the right of {b}?",
        "As the camera sees it, on which side of {b} is {a}?",
        "Is {a} left or right of {b} in the picture?",
        "Looking at the picture, does {a} come left or right of {b}?",
    )),
    "gap": Family(SCENE, (
        "{size}How wide is the gap between {a} and {b}, in centimetres?",
        "{size}How many centimetres of free space are between {a} and {b}?",
        "{size}Estimate the least distance between {a} and {b} in centimetres.",
        "{size}What distance, in centimetres, separates {a} from {b}?",
    )),
    "nearest_object": Family(SCENE, (
        "Which object is nearest to {a}?",
        "What stands closest to {a}?",
        "Which of the objects has the smallest gap to {a}?",
        "Name the closest neighbour of {a}.",
    )),
    "clearance": Family(SCENE, (
        "{robot}Is there at least {cm} cm of clearance from {a} to other objects, going {d}?",
        "{robot}Going {d} from {a}, is there a free space of {cm} cm?",
        "{robot}Does {a} have {cm} cm or more of clearance, going {d}?",
        "{robot}From {a}, are the next {cm} cm, going {d}, free of other objects?",
    )),
    "grasp_and_clearance": Family(SCENE, (
        "{robot}Which object calls for {grasp}, and is there at least {cm} cm of clearance from it, going {d}?",
        "{robot}Find the object that is best taken with {grasp}. Are {cm} cm free from it, going {d}?",
        "{robot}One object is best held with {grasp}: which, and does it have {cm} cm of clearance, going {d}?",
        "{robot}Name the object for {grasp}; is the space of {cm} cm from it, going {d}, free?",
    )),
    "taller": Family(SCENE, (
        "As they stand, which is taller: the object at {p} or the one at {q}?",
        "Which reaches higher above the {surface}, the object at {p} or that at {q}?",
        "Of the objects at {p} and {q}, which one rises higher?",
        "Compare the objects at {p} and {q}: which stands taller?",
    )),
    "occluder": Family(SCENE, (
        "Which object stands in front of {a} and hides some of it?",
        "What covers a part of {a} in this picture?",
        "By which object is {a} partly occluded?",
        "Some of {a} cannot be seen; which object is in front?",
    )),
    "slide": Family(TASK, (
        "{robot}If the robot slides {a} {cm} cm {d}, does it hit another object?",
        "{robot}Would sliding {a} {cm} cm {d} cause a collision?",
        "{robot}The robot slides {a} {cm} cm {d}. Is there a risk of collision?",
        "{robot}Does {a} run into something when it is slid {cm} cm {d}?",
    )),
    "slide_two_legs": Family(TASK, (
        "{robot}If the robot slides {a} {cm} cm {d} and then {cm2} cm {d2}, identify the risk of collision.",
        "{robot}{A} is slid {cm} cm {d}, then {cm2} cm {d2}. Does it hit another object?",
        "{robot}Would a collision occur if {a} were slid {cm} cm {d} and after that {cm2} cm {d2}?",
        "{robot}Does {a} collide with anything on its way: {cm} cm {d}, then {cm2} cm {d2}?",
    )),
    "slide_hits": Family(TASK, (
        "{robot}If the robot slides {a} {cm} cm {d}, what does it hit first?",
        "{robot}Sliding {a} {cm} cm {d}: which object is in the way?",
        "{robot}Which object does {a} run into when it is slid {cm} cm {d}?",
        "{robot}{A} is pushed {cm} cm {d}. Which object is struck first?",
    )),
    "blocked_direction": Family(TASK, (
        "{robot}{A} can be slid {cm} cm in all but one of these directions without a collision. Which one is blocked?",
        "{robot}In which direction does {a} collide if it is slid {cm} cm?",
        "{robot}The robot wants to slide {a} by {cm} cm. Which direction must it avoid?",
        "{robot}Which of these ways is not free for sliding {a} {cm} cm?",
    )),
    "heavier": Family(TASK, (
        "Which should the robot expect to be heavier: the object at {p} or the one at {q}?",
        "Of the objects at {p} and {q}, which weighs more?",
        "The robot may lift only the lighter of the objects at {p} and {q}. Which one does it leave?",
        "Which needs the greater lifting force, the object at {p} or that at {q}?",
    )),
    "box_of_object": Family(DETECTION, (
        "Give the bounding box of {a}.",
        "Detect {a}: where is its bounding box?",
        "Draw a box around what can be seen of {a}.",
        "Which box encloses the visible part of {a}?",
    )),
    "count_objects": Family(DETECTION, (
        "How many objects are on the {surface}?",
        "Count the objects on the {surface}.",
        "What is the number of objects on the {surface}?",
        "How many things lie or stand on the {surface}?",
    )),
    "is_there": Family(DETECTION, (
        "Is there {c} in this picture?",
        "Can you see {c}?",
        "Does the picture show {c}?",
        "Is {c} among the objects?",
    )),
    "list_objects": Family(DETECTION, (
        "Enumerate and identify all objects on the {surface}.",
        "List every object on the {surface}.",
        "Which objects are on the {surface}? Name them from left to right in the picture, by their middles.",
        "Name all the things on the {surface}.",
    )),
    "list_containers": Family(DETECTION, (
        "Enumerate and identify all containers on the {surface}: {kinds}.",
        "Which containers ({kinds}) are on the {surface}?",
        "List the containers on the {surface}, counting {kinds}.",
        "Identify every container ({kinds}) on the {surface}.",
    )),
}  # fmt: skip
"""The families by name."""
