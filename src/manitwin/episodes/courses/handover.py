"""From hand to hand: the first arm brings the target to a meeting place, the second takes it, the first lets go and goes home."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from manitwin.episodes.courses.course import Course, Ended, Start
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.held_path import HeldPath, HeldPathPlanner
from manitwin.episodes.planning.problem import Motion, Phase
from manitwin.episodes.planning.two_arms import HandoverPlan, Take, TwoArmPlanner
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import MeantContacts
from manitwin.robots.two_arms import base_to_world

GIVER, TAKER = 0, 1
MEETINGS = 24
HEIGHTS_M, ASIDE_M, ALONG_M = (0.35, 0.55), 0.15, 0.08  # of the middle of the object, about half way between the bases
TILTED_SHARE, TILT_RAD = 0.7, np.radians(100)
RISEN_M = 0.03  # over which the meeting place is come up to
MEET_S, LONGEST_S = 0.8, 3.0
BOTH_HOLD_S, HOLD_S = 0.2, 0.5


class HandoverCourse(Course):
    """Gives with the first arm, takes with the second, and ends with the target in the second hand."""

    def __init__(self, start: Start, facts: EpisodeFacts):
        """Draw where the arms may meet."""
        super().__init__(start, facts)
        assert isinstance(start.planner, TwoArmPlanner), "a handover is planned for two arms"
        self._arms = start.planner
        bases = [base_to_world(planner.robot)[:3, 3] for planner in (self._arms, self._arms.taker)]
        rng = np.random.default_rng((self.problem.seed, 3))
        self._meetings = meetings(self.problem.target, (bases[GIVER] + bases[TAKER]) / 2, rng)

    @property
    def ends_at(self) -> np.ndarray | None:
        """In the second hand."""
        return None

    def plan(self) -> bool:
        """Plan both halves with the first pair of grasps and the first meeting that serve."""
        plan, report = self._arms.plan_handover(self.problem, self._meetings, longest_s=LONGEST_S)
        self.facts.grasps_tried = report.tried
        self.facts.plan_failures += report.failures
        if plan is None:
            return False
        self._plan = plan
        self.facts.grasp, self.facts.taker_grasp = plan.give.grasp, plan.take.grasp
        return True

    def execute(self, execution: Execution) -> None:
        """Give, take, let go, withdraw, and hold; raises Ended where the first hand loses the target, or none can take it."""
        execution.use(GIVER)
        self._bring(self._plan, execution)
        here, giver_to_object = execution.target_to_world(), execution.gripper_to_object()
        giver_rad = execution.commanded_rad
        take = self._arms.plan_take(
            self.problem,
            here,
            giver_rad,
            self._plan.give.grasp.width_m,
            giver_to_object,
            first=(self._plan.take.grasp,),
        )
        self.facts.replans["take" if take is not None else "take_failed"] += 1
        if take is None:
            raise Ended("replan_failed")
        self.facts.taker_grasp = take.grasp
        execution.use(TAKER)
        execution.follow(take.reach)
        execution.follow(take.approach)
        execution.close()
        execution.wait_s(Phase.HOLD, BOTH_HOLD_S)
        execution.use(GIVER)
        self._let_go(take, execution)
        execution.use(TAKER)
        carry = self._arms.plan_bring_home(
            self.problem, execution.gripper_to_object(), execution.commanded_rad, self._giver_rad
        )
        self.facts.replans["brought_home" if carry is not None else "not_brought_home"] += 1
        if carry is not None:
            execution.follow(carry)
        execution.wait_s(Phase.HOLD, HOLD_S)

    def _bring(self, plan: HandoverPlan, execution: Execution) -> None:
        """Grasp, lift, measure the object in the hand, plan carry and meeting anew, and go there."""
        give = plan.give
        self.grasp_and_lift(execution, give.reach, give.approach, give.lift)
        execution.meant = MeantContacts(target=frozenset())
        held = HeldPathPlanner(self._arms.parts)
        asked = self._arms.with_taker_at(self.problem, self._arms.taker.arm.home, None)
        found = held.again(
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
        execution.follow(held.timed(joints, MEET_S, Phase.ACT))
        self.measure_slip(give, execution)
        self.check_held(execution)

    def _let_go(self, take: Take, execution: Execution) -> None:
        """Open the first hand, withdraw it and bring its arm home, as far as there is a way."""
        execution.open()
        where = self.problem, execution.target_to_world(), execution.commanded_rad, take.joints_rad, take.grasp
        back = self._arms.plan_withdrawal(*where)
        self.facts.replans["withdrawn" if back is not None else "not_withdrawn"] += 1
        home: Motion | None = None
        if back is not None:
            execution.follow(back)
            where = self.problem, execution.target_to_world(), execution.commanded_rad, take.joints_rad, take.grasp
            home = self._arms.plan_home(*where)
            self.facts.replans["home" if home is not None else "not_home"] += 1
        if home is not None:
            execution.follow(home)
        self._giver_rad = execution.commanded_rad


def meetings(target: PlacedObject, middle_m: np.ndarray, rng: np.random.Generator) -> tuple[HeldPath, ...]:
    """Return ways to bring a target's middle to some place in the air near ``middle_m (3,)``, turned as drawn.

    Some leave it as it lay but for its heading, most tilt it by up to 100 degrees.
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
