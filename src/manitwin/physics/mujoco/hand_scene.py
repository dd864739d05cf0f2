"""MuJoCo scene of a grasp trial: one object and one stationary parallel hand, and the softness of their contacts."""

from __future__ import annotations

import mujoco
import numpy as np

from manitwin.geometry.poses import quaternion_wxyz, transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.mujoco.body import (
    OBJECT,
    STIFF_SOLREF,
    add_box,
    add_object,
    contact_parameters,
    new_spec,
)
from manitwin.physics.shared_target import SharedTarget
from manitwin.physics.trial import TrialSettings
from manitwin.physics.trial_phases import HandContacts
from manitwin.robots.grippers.parallel import ParallelGripper

IMPEDANCE_RATIO = 1000.0  # MuJoCo's impratio, frictional to normal impedance: high enough to suppress lateral creep
FINGER_MASS_KG = 0.1
MET_M = -0.001  # mean pad distance at which the pads have met: contacts and stops each yield half a millimetre at 50 N
MAX_DRIVE_FORCE = 4.0  # force limit of the drives over the closing force: never limits the closing force itself
FINGERS = ("finger_plus", "finger_minus")
SINK_M = 0.0005  # contact penetration under the closing force: that of a heavy object at MuJoCo's default impedance
LEAST_IMPEDANCE, MOST_IMPEDANCE = 0.95, 0.9999  # MuJoCo's default, and the largest accepted value (mjMAXIMP)
IMPEDANCE_WIDTH_M, IMPEDANCE_MIDPOINT, IMPEDANCE_POWER = 0.001, 0.5, 2.0  # MuJoCo's defaults


class HandScene:
    """MuJoCo scene of one grasp (``TrialScene``), in the hand's frame.

    The load is the scene's gravity, which is compensated on the fingers.
    """

    def __init__(
        self, model: mujoco.MjModel, gripper: ParallelGripper, object_to_hand: np.ndarray, settings: TrialSettings
    ):
        """Place the object in the open hand of a model made by ``hand_model``."""
        self.model, self.data = model, mujoco.MjData(model)
        self.target = SharedTarget(gripper.opening_m, settings, MET_M)
        self.reached_m = self.target.value_m
        self.object = model.body(OBJECT).id
        self.fingers = [model.body(name).id for name in FINGERS]
        self.joints = [model.joint(name).qposadr[0] for name in FINGERS]
        free = model.joint(OBJECT).qposadr[0]
        self.data.qpos[self.joints] = self.data.ctrl[:] = gripper.opening_m / 2
        self.data.qpos[free : free + 3] = object_to_hand[:3, 3]
        self.data.qpos[free + 3 : free + 7] = quaternion_wxyz(object_to_hand[:3, :3])

    def advance(self, loads_m_s2: np.ndarray) -> None:
        """Take one step for each row of accelerations ``(N, 3)`` m/s^2 of the object in the hand's frame."""
        model, data, gravity = self.model, self.data, self.model.opt.gravity
        start, count = self.reached_m, len(loads_m_s2)
        for number, load in enumerate(loads_m_s2, start=1):
            gravity[:] = load
            data.ctrl[:] = start + (self.target.value_m - start) * number / count
            mujoco.mj_step(model, data)
        self.reached_m = self.target.value_m

    def squeeze(self) -> None:
        """Advance the fingers' shared target by one frame; the steps of the frame interpolate to it linearly.

        Without interpolation the fingers would move twice as fast within a frame and knock light objects away.
        """
        self.target.advance_target(float(self.data.qpos[self.joints].mean()))

    def presses(self) -> bool:
        """Tell whether the target is far enough ahead of the fingers that they press with the closing force."""
        return self.target.presses

    def contacts(self) -> HandContacts:
        """Return the inward forces (N) of the +X and the -X finger, and the deepest overlap (m) of hand and object."""
        forces, deepest, wrench = [0.0, 0.0], 0.0, np.zeros(6)
        for index, contact in enumerate(self.data.contact):
            bodies = self.model.geom_bodyid[list(contact.geom)]
            if self.object not in bodies:
                continue
            deepest = max(deepest, -float(contact.dist))
            # a contact normal points from the first geom to the second
            towards_object = 1 if bodies[1] == self.object else -1
            for side, finger in enumerate(self.fingers):
                if finger in bodies:
                    mujoco.mj_contactForce(self.model, self.data, index, wrench)
                    push_x = towards_object * float(contact.frame[0] * wrench[0])
                    forces[side] += push_x * (-1, 1)[side]
        return HandContacts((forces[0], forces[1]), deepest)

    def object_to_hand(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame."""
        return transform(self.object_rotation(), self.data.xpos[self.object])

    def hand_joints(self) -> np.ndarray:
        """Return the distances (m) of the +X and the -X pad from the plane x = 0."""
        return np.array(self.data.qpos[self.joints])

    def object_rotation(self) -> np.ndarray:
        """Return the object's rotation ``(3, 3)`` in the hand's frame."""
        return self.data.xmat[self.object].reshape(3, 3).copy()

    def center_of_mass_m(self) -> np.ndarray:
        """Return the object's centre of mass ``(3,)`` m in the hand's frame."""
        return self.data.xipos[self.object].copy()


def hand_model(body: RigidBody, gripper: ParallelGripper, settings: TrialSettings) -> mujoco.MjModel:
    """Compile the model of hand and object; contacts use the mean friction, as SAPIEN does (MuJoCo's own rule is the maximum)."""
    spec = new_spec(settings.timestep_s)
    spec.option.impratio = IMPEDANCE_RATIO
    contact = contact_parameters((settings.finger_friction + body.friction_static) / 2, STIFF_SOLREF)
    contact["solimp"] = even_impedance(body.mass_kg, settings.force_n)
    _add_hand(spec, gripper, settings, contact)
    add_object(spec, body, contact)
    return spec.compile()


def even_impedance(mass_kg: float, force_n: float) -> list[float]:
    """Return the ``solimp`` for which finger contacts penetrate by ``SINK_M`` at the closing force, for any object mass.

    A contact at rest that carries f penetrates by r = R f / k, with R = (1 - d) / d (1/m + 1/m_finger) and k = 1 / (d
    timeconst dampratio)^2 (MuJoCo manual, "Computation", "Parameters"): at a fixed impedance d, lighter objects penetrate
    more. The equation is solved for d. The impedance at first touch is lower in the same proportion as in MuJoCo's default.
    """
    per_mass = 1 / mass_kg + 1 / FINGER_MASS_KG
    stiffness = 1 / (STIFF_SOLREF[0] * STIFF_SOLREF[1]) ** 2
    yielding = SINK_M * stiffness / (force_n * per_mass)
    # uses k at d = 1, since d is close to 1
    impedance = float(np.clip(1 / (1 + yielding), LEAST_IMPEDANCE, MOST_IMPEDANCE))
    return [1 - 2 * (1 - impedance), impedance, IMPEDANCE_WIDTH_M, IMPEDANCE_MIDPOINT, IMPEDANCE_POWER]


def _add_hand(
    spec: mujoco.MjSpec, gripper: ParallelGripper, settings: TrialSettings, contact: dict[str, object]
) -> None:
    boxes, first, count = gripper.boxes(0.0), len(gripper.palm_boxes), len(gripper.finger_boxes)
    bodies = [(spec.worldbody, boxes[:first])]
    for side, name in enumerate(FINGERS):
        finger = spec.worldbody.add_body(name=name, gravcomp=1)
        finger.mass, finger.inertia, finger.explicitinertial = FINGER_MASS_KG, [1e-4] * 3, True
        joint = finger.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_SLIDE, axis=[(1, -1)[side], 0, 0])
        joint.range, joint.limited = [0.0, gripper.opening_m / 2], True
        start = first + side * count
        bodies.append((finger, boxes[start : start + count]))
        drive = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        drive.gaintype, drive.biastype = mujoco.mjtGain.mjGAIN_FIXED, mujoco.mjtBias.mjBIAS_AFFINE
        drive.gainprm[0] = settings.finger_stiffness_n_m
        drive.biasprm[1:3] = [-settings.finger_stiffness_n_m, -settings.finger_damping_n_s_m]
        limit_n = MAX_DRIVE_FORCE * settings.force_n
        drive.forcerange, drive.forcelimited = [-limit_n, limit_n], True
    for holder, some in bodies:
        for box_to_gripper, half_extents_m in some:
            add_box(holder, box_to_gripper, half_extents_m, contact, contact_types=(1, 2))
