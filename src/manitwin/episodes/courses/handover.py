"""Handover course: the first arm brings the target to a meeting place, the second takes it and puts it down on its own side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.courses.course import Course, EpisodeEnded, EpisodeStart, Planner
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.events import EventWatch
from manitwin.episodes.execution import Execution
from manitwin.episodes.handover_watch import HandoverWatch
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.held_path import HeldPathPlanner
from manitwin.episodes.planning.placement import Placement
from manitwin.episodes.planning.placement_choice import MOST_PLANNED, PLACES, HeldGrasp, put_down_poses
from manitwin.episodes.planning.problem import Grasp, Phase
from manitwin.episodes.planning.two_arms import HandoverPlan, TakePlan, TwoArmPlanner
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import NONE_MEANT, AllowedContacts
from manitwin.physics.sapien.world import RobotWorld
from manitwin.robots.two_arms import base_to_world

GIVER, TAKER = 0, 1
MEETINGS = 24
OTHER_MEETINGS = 12  # number of meeting places tried if the target has turned in the first hand
# ranges of the meeting point relative to the midpoint between the bases
HEIGHTS_M, ASIDE_M, ALONG_M = (0.35, 0.55), 0.15, 0.08
TILTED_SHARE, TILT_RAD = 0.7, np.radians(100)
RISEN_M = 0.03  # the meeting place is approached from this far below
MEET_S, LONGEST_S = 0.8, 3.0
BOTH_HOLD_S, HOLD_S = 0.2, 0.5


class HandoverCourse(Course):
    """Hands the target from the first arm to the second, which puts it down on its side of the table."""

    lifts_steadily = True

    def __init__(self, start: EpisodeStart, facts: EpisodeFacts):
        """Sample meeting places and placements."""
        super().__init__(start, facts)
        assert isinstance(start.planner, TwoArmPlanner), "a handover is planned for two arms"
        self._arms = start.planner
        bases = [base_to_world(planner.robot)[:3, 3] for planner in (self._arms, self._arms.taker)]
        self._meetings = sample_meeting_paths(self.problem.target, (bases[GIVER] + bases[TAKER]) / 2, self._rng(3))
        goals = put_down_poses(
            self.problem.target,
            (self.problem.target.object_to_world, *(() if start.skill_goal is None else start.skill_goal.poses[1:])),
            self._arms.taker.robot.workspace,
            base_to_world(self._arms.taker.robot),
            (*self.problem.static_boxes, *self.problem.fixtures),
            self.problem.obstacles,
            start.settings.release_height_m,
            self._rng(9),
        )
        self._giver_is_home = False
        self._put_down, self._goal = (
            self._arms.placement_choice(self.problem, goals),
            start.problem.goal_object_to_world,
        )

    @property
    def planned_end_pose(self) -> np.ndarray | None:
        """Pose ``(4, 4)`` at which the second arm puts the target down."""
        return self._goal

    @property
    def put_back_planner(self) -> Planner:
        """Planner of the first arm alone, with the second one at home."""
        return self._arms.giver_planner

    def watches(self, world: RobotWorld) -> Sequence[EventWatch]:
        """Return the watch of which arm holds the target."""
        target = self.problem.target
        giver, taker = (each.robot.name for each in world.robots)

        def center() -> np.ndarray:
            return transform_points(world.pose_of(target.name), target.body.center_of_mass_m[None])[0]

        return (HandoverWatch(target.name, giver, taker, center),)

    def plan(self) -> bool:
        """Plan both halves with the first feasible pair of grasps and meeting place."""
        self.record_missing_grasp()
        plan, report = self._arms.plan_handover(self.problem, self._meetings, self._put_down, longest_s=LONGEST_S)
        self.facts.grasps_tried += report.tried
        self.facts.plan_failures += report.failures
        if plan is None:
            return False
        self._plan = plan
        self.facts.grasp, self.facts.taker_grasp = plan.give.grasp, plan.take.grasp
        goal = self._put_down.first_feasible_goal(HeldGrasp(plan.take.grasp, plan.take.gripper_to_object))
        assert goal is not None, "the second grasp was chosen so"
        self._goal = goal
        return True

    def execute(self, execution: Execution) -> None:
        """Give, take, release, withdraw, hold, and put down; raises Ended if a hand loses the target or no motion is found."""
        execution.use(GIVER)
        self._bring(self._plan, execution)
        take = self._take_from(execution, self._plan.take.grasp)
        self.facts.replans["take" if take is not None else "take_failed"] += 1
        take = take or self._move_to_other_meeting(execution)
        if take is None:
            self.put_back_if_turned(self._plan.give, execution)
            raise EpisodeEnded("replan_failed")
        self.facts.taker_grasp = take.grasp
        execution.use(TAKER)
        execution.follow(take.reach)
        execution.follow(take.approach)
        execution.close_hand()
        execution.wait_s(Phase.HOLD, BOTH_HOLD_S)
        execution.use(GIVER)
        self._release_and_withdraw(take, execution)
        execution.use(TAKER)
        execution.wait_s(Phase.HOLD, HOLD_S)
        self.check_held(execution)
        self._set_down(take, execution)

    def _take_from(self, execution: Execution, first: Grasp) -> TakePlan | None:
        """Plan how the second arm takes the target from its current pose in the first hand, preferring the grasp ``first``."""
        width_m, there = self._plan.give.grasp.width_m, execution.target_to_world()
        return self._arms.plan_take(
            self.problem,
            there,
            execution.commanded_rad,
            width_m,
            execution.gripper_to_object(),
            self._put_down,
            first=(first,),
        )

    def _move_to_other_meeting(self, execution: Execution) -> TakePlan | None:
        """Move the target, as it lies in the first hand now, to another meeting place where the second arm can take it."""
        held, give, measured = HeldPathPlanner(self._arms.parts), self._plan.give, execution.gripper_to_object()
        asked = self._arms.with_taker_at(self.problem, self._arms.taker.arm.home, None)
        for meeting in [each for each in self._meetings if each is not give.held][:OTHER_MEETINGS]:
            here, width_m = execution.commanded_rad, give.grasp.width_m
            found = held.replan(asked, [meeting], measured, here, here, as_hulls=False, longest_s=LONGEST_S)
            if found is None:
                continue
            carry, path, joints = found
            where = self.problem, path.poses[-1], joints(1.0), width_m, measured, self._put_down
            take = self._arms.plan_take(*where, first=(self._plan.take.grasp,))
            if take is None:
                continue
            execution.follow(carry)
            execution.follow(held.time_path(joints, MEET_S, Phase.ACT))
            self.check_held(execution)
            take = self._take_from(execution, take.grasp)
            self.facts.replans["elsewhere" if take is not None else "elsewhere_failed"] += 1
            return take
        return None

    def _set_down(self, take: TakePlan, execution: Execution) -> None:
        """Carry the target to the table on the second arm's side, release it and go home; raises Ended if there is no plan."""
        held = HeldGrasp(take.grasp, take.gripper_to_object)
        placement = self._placement(held, execution) if self._giver_is_home else None
        if placement is None:
            self._bring_home(execution)
            if not self._giver_is_home:
                taker_rad = execution.commanded_rad
                execution.use(GIVER)
                self._bring_giver_home(taker_rad, take, execution)
                self._giver_rad = execution.commanded_rad
                execution.use(TAKER)
            placement = self._placement(held, execution, PLACES)
        if placement is None:
            raise EpisodeEnded("replan_failed")
        carry, lower, retreat = placement
        assert carry is not None, "it is carried there"
        execution.follow(carry)
        self.check_held(execution)
        asked = self._arms.with_giver_at(self.problem, self._giver_rad)
        where = execution.commanded_rad, execution.gripper_to_object(), self._goal
        found = self._arms.taker.plan_place(asked, held, *where, False)
        self.facts.replans["late" if found is not None else "late_failed"] += 1
        if found is not None:
            _, lower, retreat = found
        execution.meant = NONE_MEANT
        execution.follow(lower)
        execution.open_hand()
        execution.follow(retreat)
        target = replace(self.problem.target, object_to_world=execution.target_to_world())
        home = self._arms.plan_taker_home(
            replace(self.problem, target=target), execution.commanded_rad, self._giver_rad
        )
        if home is not None:
            execution.follow(home)
        execution.use(GIVER)

    def _placement(self, held: HeldGrasp, execution: Execution, most: int = MOST_PLANNED) -> Placement | None:
        """Plan a placement out of up to ``most`` places, and the motion there from the second arm's current joints."""
        asked = self._arms.with_giver_at(self.problem, self._giver_rad)
        found = self._put_down.plan(asked, held, execution.commanded_rad, execution.gripper_to_object(), most)
        self.facts.replans["put_down" if found is not None else "put_down_failed"] += 1
        if found is None:
            return None
        self._goal, placement = found
        return placement

    def _bring_home(self, execution: Execution) -> None:
        """Move the target out of the way: with the second arm to its home, or straight up."""
        carry = self._arms.plan_bring_home(
            self.problem, execution.gripper_to_object(), execution.commanded_rad, self._giver_rad
        )
        self.facts.replans["brought_home" if carry is not None else "not_brought_home"] += 1
        if carry is not None:
            execution.follow(carry)

    def _bring(self, plan: HandoverPlan, execution: Execution) -> None:
        """Grasp, lift, measure the object in the hand, replan carry and meeting, and move to the meeting place."""
        give = plan.give
        self.grasp_and_lift(execution, give.reach, give.approach, give.lift)
        execution.meant = AllowedContacts(target=frozenset())
        held = HeldPathPlanner(self._arms.parts)
        asked = self._arms.with_taker_at(self.problem, self._arms.taker.arm.home, None)
        found = held.replan(
            asked,
            [give.held],
            execution.gripper_to_object(),
            execution.commanded_rad,
            give.joints(0.0),
            as_hulls=False,
            longest_s=LONGEST_S,
        )
        self.facts.replans["after_lift" if found is not None else "after_lift_failed"] += 1
        carry, joints = (give.carry, give.joints) if found is None else (found[0], found[2])
        execution.follow(carry)
        execution.follow(held.time_path(joints, MEET_S, Phase.ACT))
        self.measure_slip(give, execution)
        self.check_held(execution)

    def _rng(self, purpose: int) -> np.random.Generator:
        return np.random.default_rng((self.problem.seed, purpose))

    def _release_and_withdraw(self, take: TakePlan, execution: Execution) -> None:
        """Open the first hand, withdraw it and bring its arm home, as far as a motion is found."""
        execution.open_hand()
        where = self.problem, execution.target_to_world(), execution.commanded_rad, take.joints_rad, take.grasp
        back = self._arms.plan_withdrawal(*where)
        self.facts.replans["withdrawn" if back is not None else "not_withdrawn"] += 1
        if back is not None:
            execution.follow(back)
            self._bring_giver_home(take.joints_rad, take, execution)
        self._giver_rad = execution.commanded_rad

    def _bring_giver_home(self, taker_rad: np.ndarray, take: TakePlan, execution: Execution) -> None:
        """Bring the first arm home around the second, which holds the target, if a motion is found."""
        where = self.problem, execution.target_to_world(), execution.commanded_rad, taker_rad, take.grasp
        home = self._arms.plan_home(*where)
        self.facts.replans["home" if home is not None else "not_home"] += 1
        self._giver_is_home = home is not None
        if home is not None:
            execution.follow(home)


def sample_meeting_paths(target: PlacedObject, middle_m: np.ndarray, rng: np.random.Generator) -> tuple[HeldPath, ...]:
    """Return sampled paths that bring the target's centre to places in the air near ``middle_m (3,)``.

    Some keep the target's tilt and change its heading only; most also tilt it by up to 100 degrees.
    """
    center = np.mean([points.mean(0) for points in target.body.hulls], axis=0)
    offset = target.object_to_world[:3, :3] @ center
    found = []
    for _ in range(MEETINGS):
        at_m = middle_m + np.array(
            [rng.uniform(-ALONG_M, ALONG_M), rng.uniform(-ASIDE_M, ASIDE_M), rng.uniform(*HEIGHTS_M)]
        )
        heading, side = rng.uniform(-np.pi, np.pi, 2)
        tilt = rng.uniform(0, TILT_RAD) if rng.uniform() < TILTED_SHARE else 0.0
        turn = Rotation.from_rotvec(tilt * np.array([np.cos(side), np.sin(side), 0])) * Rotation.from_euler(
            "z", heading
        )
        rotation = turn.as_matrix() @ target.object_to_world[:3, :3]
        meeting = transform(rotation, at_m - turn.as_matrix() @ offset)
        below = transform(translation=np.array([0.0, 0, -RISEN_M])) @ meeting
        found.append(HeldPath(np.array([below, meeting])))
    assert np.allclose(transform_points(found[-1].poses[-1], center[None])[0], at_m)
    return tuple(found)
