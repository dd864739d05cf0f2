"""Held-object course: grasp, lift, then follow the skill's path, replanned from the measured pose in the hand."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from manitwin.episodes.courses.course import TURNED_RAD, Course, EpisodeEnded, EpisodeStart
from manitwin.episodes.courses.force_control import Admittance, pace_of_press, with_heights
from manitwin.episodes.courses.held_grasps import grasps_of_task
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.events import EventWatch
from manitwin.episodes.execution import Execution
from manitwin.episodes.outcome import turned_rad
from manitwin.episodes.planning.closed_hand import fingertip_corners
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.held_path import HeldPathPlanner, HeldPlan
from manitwin.episodes.planning.path_timing import joint_spline, time_quintic
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Motion, Phase
from manitwin.episodes.planning.withdrawal import plan_withdrawal
from manitwin.episodes.skills.held_task import ForceControlledMove, GuardedMove, HeldScene, HeldTask
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import AllowedContacts
from manitwin.physics.sapien.world import RobotWorld

BACK_S = 1.2
YIELDED_S, PRESSED_S = 0.1, 0.2  # hold time after contact, for a blow and for a press
RISEN_M = (0.01, 0.03)  # heights of a straight rise before the way back
# an object that turned in the hand is put back in the first feasible heading
PUT_BACK_RAD = np.radians([0.0, 45, -45, 90, -90, 135, -135, 180])
PEAK_OF_QUINTIC = 1.875  # ratio of peak to mean speed
MADE_UP_RAD, MADE_UP_TIMES, MADE_UP_S = np.radians(4.0), 3, 0.4
"""Correction of an object that turned in the hand at the path's end: tolerance, most repetitions, and duration of each."""
CREEPS_M = 0.002  # distance before contact at which a press creeps: the error of measured object poses, and a margin


class HeldCourse(Course):
    """Follows a skill's held path; if replanning fails, the original plan is followed."""

    lifts_steadily = True

    def __init__(self, start: EpisodeStart, facts: EpisodeFacts):
        """Create the skill's task."""
        super().__init__(start, facts)
        goal, planner = start.skill_goal, start.planner
        assert goal is not None
        assert goal.path is not None
        assert isinstance(planner, PickPlacePlanner), "held paths are planned with the models of this planner"
        self._own = planner
        robot = planner.robot
        scene = HeldScene(
            target=self.problem.target,
            objects={each.name: each for each in start.objects},
            partner=next((each for each in start.objects if each.name == goal.partner), None),
            frames=goal.frames,
            openings=goal.openings,
            places_m=goal.places_m,
            fixtures=goal.fixtures,
            fingers=frozenset(robot.finger_links),
            fingertips_m=fingertip_corners(planner.closed_hand),
            tip_depth_m=robot.gripper.tip_depth_m,
            rng=np.random.default_rng((self.problem.seed, 3)),
        )
        self.task: HeldTask = goal.path(scene)
        self.problem = replace(self.problem, entered=self.task.enters)
        self._planner = HeldPathPlanner(
            planner.closed_hand if self.task.empty else planner.parts,
            empty=self.task.empty,
            lets_go=self.task.ending == "let_go",
            level_rad=self.task.level_rad,
        )
        self._watch: EventWatch | None = None

    @property
    def planned_end_pose(self) -> np.ndarray | None:
        """Planned final pose of the target: at the path's end or where it started; None if it stays in the hand."""
        if self.task.ending == "keep" and not self.task.empty:
            return None
        let_go = self.task.ending == "let_go" and not self.task.empty
        return self._held.poses[-1] if let_go else self.problem.target.object_to_world

    def watches(self, world: RobotWorld) -> Sequence[EventWatch]:
        """Return the task's watch, if it has one."""
        self._watch = None if self.task.watch is None else self.task.watch(world)
        return () if self._watch is None else (self._watch,)

    def plan(self) -> bool:
        """Plan with the grasps that do not block the function."""
        task = self.task
        if task.empty:
            found = self._planner.plan_empty(self.problem, task.paths, longest_s=task.longest_s)
            if not isinstance(found, tuple):
                self.facts.plan_failures.update(found)
                return False
            self._reach, self._held, self._joints = found
            return True
        body, gripper = self.problem.target.body, self._own.robot.gripper
        grasps, left_out = grasps_of_task(self.tiers(), task, body, gripper)
        self.problem = replace(self.problem, grasps=grasps)
        self.facts.grasps_tried += left_out.total()
        self.facts.plan_failures.update(left_out)
        plan = None
        for paths in (task.paths, task.otherwise):
            plan, report = self._planner.plan(self.problem, paths, as_hulls=task.as_hulls, longest_s=task.longest_s)
            if plan is not None or paths is task.paths:
                self.facts.grasps_tried += report.tried
                self.facts.plan_failures += report.failures
            if plan is not None or not task.otherwise:
                break
        if plan is None:
            return False
        self._plan, self._held, self._joints = plan, plan.held, plan.joints
        self.facts.grasp = plan.grasp
        return True

    def execute(self, execution: Execution) -> None:
        """Grasp and lift (or close the empty hand), carry, follow the path, and end as the task specifies."""
        if self.task.empty:
            execution.close_empty_hand()
            execution.follow(self._reach)
            self._grasp_now = np.eye(4)
        else:
            self._grasp_and_carry(self._plan, execution)
        been = self._follow_path(execution)
        self._rest_there(execution)
        if self.task.ending == "let_go":
            self._release_and_withdraw(execution)
            return
        if not self.task.comes_out:
            self._return_along_path(execution, been)
        if not self.task.empty:
            self.check_held(execution)
        if self.task.ending == "put_back":
            self._put_back(execution)

    def _grasp_and_carry(self, plan: HeldPlan, execution: Execution) -> None:
        """Grasp, lift, replan carry and path for the measured pose in the hand, and carry; replan again if the object turned."""
        self.grasp_and_lift(execution, plan.reach, plan.approach, plan.lift)
        self._grasp_now = plan.gripper_to_object
        carry = self._plan_again(plan.held, plan.joints, execution)
        self.facts.replans["after_lift" if carry is not None else "after_lift_failed"] += 1
        if carry is None:
            self.put_back_if_turned(plan, execution)
        measured = execution.gripper_to_object()
        execution.meant = AllowedContacts(target=frozenset())
        execution.follow(plan.carry if carry is None else carry)
        self.measure_slip(plan, execution)
        self.check_held(execution)
        if carry is not None and turned_rad(measured, execution.gripper_to_object()) > TURNED_RAD:
            carry = self._plan_again(self._held, self._joints, execution)
            self.facts.replans["after_carry" if carry is not None else "after_carry_failed"] += 1
            if carry is None:
                self.put_back_if_turned(plan, execution)
            else:
                execution.follow(carry)
                self.check_held(execution)

    def _plan_again(self, held: HeldPath, joints: CubicSpline, execution: Execution) -> Motion | None:
        """Replan path and carry from here with the measured pose in the hand, trying ``held`` first; None if there is no plan."""
        measured = execution.gripper_to_object()
        found = self._planner.replan(
            self.problem,
            [held, *(path for path in (*self.task.paths, *self.task.otherwise) if path is not held)],
            measured,
            execution.commanded_rad,
            joints(0.0),
            as_hulls=self.task.as_hulls,
            longest_s=self.task.longest_s,
        )
        if found is None:
            return None
        carry, self._held, self._joints = found
        self._grasp_now = measured
        return carry

    def _follow_path(self, execution: Execution) -> list[np.ndarray]:
        """Follow the path; return the joint positions ``(n,)`` along it, for the way back."""
        task, count, meant = self.task, len(self._held.poses), self._held.meant
        execution.meant = AllowedContacts(fingers=meant) if task.empty else AllowedContacts(target=meant)
        been = [execution.commanded_rad]
        smooth = count if task.guard is None else task.guard.first
        parts = min(task.measured, smooth)
        cuts = [round(smooth * part / parts) for part in range(parts + 1)] if parts else [0]
        for first, end in pairwise(cuts):
            joints = self._onward(self._held.part(first, end), execution, (end - 1) / (count - 1))
            execution.follow(self._planner.time_path(joints, task.duration_s / parts, Phase.ACT))
            been += [*joints(np.linspace(0, 1, end - first + 1)[1:-1]), execution.commanded_rad]
        for _ in range(MADE_UP_TIMES if task.steady else 0):
            if turned_rad(self._held.poses[-1], execution.target_to_world()) <= MADE_UP_RAD:
                break
            joints = self._onward(self._held.part(count - 1, count), execution, 1.0)
            execution.follow(self._planner.time_path(joints, MADE_UP_S, Phase.ACT))
        regulated = task.regulated
        if task.guard is not None:
            end = count if regulated is None else regulated.first
            self._move_guarded(task.guard, self._held.part(smooth, end), execution)
        if regulated is not None:
            self._slide_under_force(regulated, self._held.part(regulated.first, count), execution)
        return been

    def _onward(self, part: HeldPath, execution: Execution, place: float) -> CubicSpline:
        """Plan a spline through poses from the current joints, with the measured or else the previous pose in the hand.

        If both fail, move straight in joint space to the planned position at ``place``.
        """
        grasps = [self._grasp_now] if self.task.empty else [execution.gripper_to_object(), self._grasp_now]
        for grasp, name in zip(grasps, ("onward", "onward_unmeasured"), strict=False):
            found = self._planner.plan_spline(
                self.problem, part, grasp, execution.commanded_rad, as_hulls=self.task.as_hulls
            )
            if found is not None:
                self.facts.replans[name] += 1
                return found
        self.facts.replans["onward_failed"] += 1
        return joint_spline(np.array([execution.commanded_rad, self._joints(place)]))

    def _move_guarded(self, guard: GuardedMove, part: HeldPath, execution: Execution) -> None:
        """Move until the watched force reaches the guard's limit, then hold still (or yield, after a blow).

        The arm completes the current row of samples after contact. A press therefore creeps close to the expected contact,
        and a blow is delayed so that a row ends at contact; without contact by then it continues slowly.
        """
        watch = self._watch
        assert watch is not None, "a guarded move asks its watch for the force"
        joints = self._onward(part, execution, 1.0)
        tips = [self.start.planner.tip_pose(joints(place))[:3, 3] for place in np.linspace(0, 1, 5)]
        way_m = float(np.linalg.norm(np.diff(tips, axis=0), axis=1).sum())
        duration_s = guard.duration_s if guard.speed_m_s is None else PEAK_OF_QUINTIC * way_m / guard.speed_m_s
        motion = self._planner.time_path(joints, duration_s, Phase.ACT, beyond=guard.beyond)
        touched: Callable[[], bool] = lambda: watch.force_n >= guard.stop_n  # noqa: E731
        grasp = self._grasp_now if self.task.empty else execution.gripper_to_object()
        there_m = (part.poses[max(guard.touches - guard.first, 0)] @ grasp)[:3, 3]
        ways_m = np.linalg.norm(
            [self.start.planner.tip_pose(each)[:3, 3] - there_m for each in motion.positions_rad], axis=1
        )
        if not guard.is_blow:
            creeps = int((ways_m < CREEPS_M).argmax()) if guard.touches else len(ways_m)
            execution.follow(motion, until=touched, pace=pace_of_press(watch, guard.stop_n, creeps))
            execution.wait_s(Phase.HOLD, PRESSED_S)
            return
        touches = int(ways_m.argmin())
        blow = execution.delayed(motion, touches)
        touches += len(blow.positions_rad) - len(motion.positions_rad)
        if execution.follow(blow, until=touched, pace=lambda first: float(first <= touches), yields=True):
            execution.adopt_actual_joints()
        execution.wait_s(Phase.HOLD, YIELDED_S)

    def _slide_under_force(self, regulated: ForceControlledMove, part: HeldPath, execution: Execution) -> None:
        """Slide along a path from the current contact with force control along the normal, then rise.

        Raises Ended if there is no plan from here.
        """
        watch, arm = self._watch, self._own.parts.arm
        assert watch is not None, "a move under force asks its watch for it"
        here, steps_m = execution.target_to_world(), part.poses[:, :3, 3] - part.poses[0, :3, 3]
        onward = replace(part, poses=np.array([transform(None, step) @ here for step in steps_m]))
        measured, planner, both = execution.gripper_to_object(), self._planner, None
        for way, grasp in ((onward, measured), (part, measured), (part, self._grasp_now)):
            way = way.part(1, len(way.poses))
            joints = planner.plan_spline(self.problem, way, grasp, execution.commanded_rad, as_hulls=self.task.as_hulls)
            both = None if joints is None else with_heights(joints, arm, regulated.normal)
            if both is not None:
                break
        if both is None:
            raise EpisodeEnded("replan_failed")
        way_m = float(np.linalg.norm(np.diff(steps_m, axis=0), axis=1).sum())
        limits = tuple(np.concatenate([each, np.full(len(each), np.inf)]) for each in self._own.parts.motions.limits)
        rows, speeds = time_quintic(
            both, (limits[0], limits[1]), way_m / regulated.speed_m_s, self._own.parts.timestep_s
        )
        count = arm.joints
        keeps = Admittance(lambda: watch.force_n, regulated.force_n, self._own.parts.timestep_s)
        motion = Motion(Phase.ACT, rows[:, :count], speeds[:, :count])
        execution.follow(motion, adjusted=lambda row: keeps.next_change(rows[row, count:]))

    def _rest_there(self, execution: Execution) -> None:
        if self.task.hold_s:
            execution.wait_s(Phase.HOLD, self.task.hold_s)
        if not self.task.empty:
            self.check_held(execution)

    def _release_and_withdraw(self, execution: Execution) -> None:
        """Open the hand and withdraw it as far as there is room."""
        execution.meant = AllowedContacts()
        execution.open_hand()
        away = plan_withdrawal(self._own.parts, self.problem, execution.target_to_world(), execution.commanded_rad)
        self.facts.replans["withdrawn" if away is not None else "not_withdrawn"] += 1
        if away is not None:
            execution.follow(away)

    def _return_along_path(self, execution: Execution, been: list[np.ndarray]) -> None:
        """Go back along the path, replanned from here, or else along the joint positions of the way there."""
        poses = self._held.poses[:1] if self.task.guard is not None else self._held.poses[::-1][1:]
        if self.task.rises:
            here = execution.target_to_world()
            poses = np.array(
                [*(transform(None, np.array([0, 0, each])) @ here for each in RISEN_M), self._held.poses[0]]
            )
        way = HeldPath(poses, self._held.meant)
        grasp = self._grasp_now if self.task.empty else execution.gripper_to_object()
        joints = self._planner.plan_spline(
            self.problem, way, grasp, execution.commanded_rad, as_hulls=self.task.as_hulls
        )
        self.facts.replans["back" if joints is not None else "back_as_it_came"] += 1
        if joints is None:
            joints = joint_spline(np.array([execution.commanded_rad, *been[::-1]]))
        execution.follow(self._planner.time_path(joints, BACK_S, Phase.RETURN))

    def _put_back(self, execution: Execution) -> None:
        """Put the target down where it was, or there with another heading; raises Ended if none can be planned."""
        execution.meant = AllowedContacts()
        here, measured = execution.commanded_rad, execution.gripper_to_object()
        for angle_rad in PUT_BACK_RAD:
            goal = turned_in_place(self.problem.target, angle_rad)
            goal[2, 3] += self.start.settings.release_height_m
            found = self._own.plan_place(self.problem, self._plan, here, measured, goal, True)
            if found is not None:
                break
        else:
            raise EpisodeEnded("replan_failed")
        self.facts.replans["put_back" if angle_rad == 0 else "put_back_turned"] += 1
        carry, lower, retreat = found
        assert isinstance(carry, Motion)
        execution.follow(carry)
        execution.follow(lower)
        execution.open_hand()
        execution.follow(retreat)


def turned_in_place(placed: PlacedObject, angle_rad: float) -> np.ndarray:
    """Return the pose ``(4, 4)`` of an object rotated about the vertical axis through its centre of mass."""
    center = transform_points(placed.object_to_world, placed.body.center_of_mass_m[None])[0]
    turn = Rotation.from_euler("z", angle_rad).as_matrix()
    return np.asarray(transform(None, center) @ transform(turn) @ transform(None, -center) @ placed.object_to_world)
