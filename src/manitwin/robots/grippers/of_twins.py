"""The gripper that a twin's grasps are of: a twin has its name and the digest of its file, not the file."""

from __future__ import annotations

from collections.abc import Sequence

from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers


def gripper_of(name: str, sha256: str, given: Sequence[Gripper] = ()) -> Gripper:
    """Return the gripper of this name among those ``given`` and those that are shipped.

    Raises UsageError where it is neither, and where the one that is given is another than that of the grasps.
    """
    for gripper in given:
        if gripper.name == name:
            if gripper.sha256 != sha256:
                raise UsageError(
                    f"gripper {name}: the file that is given is another than that of the twin's grasps; give that one, or"
                    " build the twin again with this"
                )
            return gripper
    if name not in shipped_grippers():
        named = f"; given are {', '.join(gripper.name for gripper in given)}" if given else ""
        raise UsageError(
            f"gripper {name} does not come with the package, and a twin has only its name{named}; give its file with --gripper"
        )
    return load_gripper(name)
