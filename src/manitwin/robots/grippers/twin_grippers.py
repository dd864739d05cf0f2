"""Lookup of the gripper for a twin's grasps: a twin stores the gripper's name and file digest, not the file."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers


def find_gripper(name: str, sha256: str, given: Sequence[Gripper] = ()) -> Gripper:
    """Return the gripper of this name among those ``given`` and the shipped ones.

    Raises UsageError if there is none, or if the given gripper's digest differs from that of the grasps.
    """
    for gripper in given:
        if gripper.name == name:
            if gripper.sha256 != sha256:
                raise UsageError(
                    f"gripper {name}: the given file differs from the one of the twin's grasps; give that file, or"
                    f" build the twin again with this one"
                )
            return gripper
    if name not in shipped_grippers():
        named = f"; given are {', '.join(gripper.name for gripper in given)}" if given else ""
        raise UsageError(
            f"gripper {name} is not shipped with the package, and a twin stores only its name{named}; give its file"
            f" with --gripper"
        )
    return load_gripper(name)


def is_different_gripper(gripper: Gripper, grippers: Mapping[str, str]) -> bool:
    """Tell whether a twin has grasps of a different gripper with the same name; ``grippers`` maps names to digests.

    A different digest of a shipped gripper is accepted: no other file can have its name, so it can only be another version.
    """
    return (
        gripper.name in grippers and grippers[gripper.name] != gripper.sha256 and gripper.name not in shipped_grippers()
    )


def require_same_gripper(gripper: Gripper, twins: Iterable[tuple[str, Mapping[str, str]]], carrier: str = "") -> None:
    """Raise UsageError if a twin has grasps of a different gripper with the same name.

    Such grasps were verified with other dimensions. ``twins`` are pairs of a twin's identity and its gripper digests by name;
    ``carrier`` is the robot that has the gripper.
    """
    given = list(twins)
    others = [twin for twin, grippers in given if is_different_gripper(gripper, grippers)]
    if not others:
        return
    more = f" (and {len(others) - 1:,} more of {len(given):,})" if len(others) > 1 else ""
    of = f" of {carrier}" if carrier else ""
    raise UsageError(
        f"twin {others[0]}{more} has grasps of a gripper {gripper.name} whose file differs from that of the"
        f" {gripper.name}{of}; build the twins again with this one (--gripper FILE.toml), give the file that they"
        f" were built"
        " with, or give the changed file a name of its own and build for it too"
    )
