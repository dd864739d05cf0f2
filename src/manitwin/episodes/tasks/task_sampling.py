"""Task sampling in a scene: balanced over kinds, each task checked by planning, without duplicates, with rejection counts."""

from __future__ import annotations

from collections import Counter, defaultdict, deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import ceil, floor

import numpy as np

from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.settings import TasksConfig
from manitwin.episodes.tasks.candidates import Candidate, SkillAction, pairs_of, single_actions
from manitwin.episodes.tasks.feasibility_check import InfeasibleTask, PlannedTask, check_candidate
from manitwin.episodes.tasks.task_scene import TaskScene

Signature = tuple[str, ...]
MOST_PAIRS = 4000  # two-literal candidates kept for sampling; all are counted


@dataclass
class CandidateCounts:
    """Counts of a scene's candidates, checked and plannable tasks by kind, and of rejections by reason."""

    candidates: Counter[str] = field(default_factory=Counter)
    checked: Counter[str] = field(default_factory=Counter)
    plannable: Counter[str] = field(default_factory=Counter)
    dropped: Counter[str] = field(default_factory=Counter)

    def to_json(self) -> dict[str, dict[str, int]]:
        """Return the counts, sorted by name."""
        return {name: dict(sorted(counts.items())) for name, counts in vars(self).items()}


def sample_tasks(
    scene: TaskScene,
    planner: PickPlacePlanner,
    settings: TasksConfig,
    rng: np.random.Generator,
    proposed: Sequence[Candidate],
    on_checked: Callable[[int], None] = lambda found: None,
) -> tuple[list[tuple[PlannedTask, int, bool]], CandidateCounts]:
    """Return tasks with their seeds and whether they were ``proposed``, and the counts; proposals come first."""
    tally = CandidateCounts()
    singles = single_actions(scene, tally.dropped)
    tally.candidates.update(action.kind for action in singles)
    pairs = list(pairs_of(singles))
    tally.candidates.update(pair.kind for pair in pairs)
    drawing = _TaskSampler(scene, planner, settings, rng, tally, on_checked)
    for candidate in proposed:
        drawing.check_candidate_and_count(candidate, proposed=True)
    two = ceil(settings.two_literal_share * settings.per_scene)
    drawing.draw([Candidate((action,)) for action in singles], settings.per_scene - two)
    able = {id(action) for action in drawing.able}
    hopeful = [pair for pair in pairs if all(id(action) in able for action in pair.actions)]
    if len(hopeful) > MOST_PAIRS:
        hopeful = [hopeful[int(place)] for place in rng.permutation(len(hopeful))[:MOST_PAIRS]]
    tally.dropped["not_drawn"] += len(pairs) - len(hopeful)
    drawing.draw(hopeful, two)
    return drawing.found, tally


class _TaskSampler:
    """Sampling state; candidates are drawn from the kinds in turn, so that rare kinds are represented."""

    def __init__(
        self,
        scene: TaskScene,
        planner: PickPlacePlanner,
        settings: TasksConfig,
        rng: np.random.Generator,
        tally: CandidateCounts,
        on_checked: Callable[[int], None],
    ):
        self.scene, self.planner, self.settings, self.rng, self.tally = scene, planner, settings, rng, tally
        self.on_checked = on_checked
        self.found: list[tuple[PlannedTask, int, bool]] = []
        self.able: list[SkillAction] = []
        self._signatures: set[Signature] = set()
        self._of_kind: Counter[str] = Counter()

    def draw(self, candidates: Sequence[Candidate], count: int) -> None:
        """Take up to ``count`` of the candidates, limiting the share of each kind."""
        queues: dict[str, deque[Candidate]] = defaultdict(deque)
        for place in self.rng.permutation(len(candidates)):
            queues[candidates[int(place)].kind].append(candidates[int(place)])
        failed: Counter[str] = Counter()
        most = max(1, floor(self.settings.most_of_kind * self.settings.per_scene))
        end = len(self.found) + count
        while len(self.found) < end and any(queues.values()):
            kinds = sorted(queues)
            for kind in (kinds[int(place)] for place in self.rng.permutation(len(kinds))):
                if len(self.found) >= end or not queues[kind]:
                    continue
                if self._of_kind[kind] >= most or failed[kind] >= self.settings.tries_of_kind:
                    self.tally.dropped["not_drawn"] += len(queues[kind])
                    queues[kind].clear()
                elif not self.check_candidate_and_count(queues[kind].popleft()):
                    failed[kind] += 1
        self.tally.dropped["not_drawn"] += sum(map(len, queues.values()))

    def check_candidate_and_count(self, candidate: Candidate, *, proposed: bool = False) -> bool:
        """Check a candidate; keep it or count the reason for its rejection."""
        signature = _task_key(self.scene, candidate)
        if signature in self._signatures:
            self.tally.dropped["duplicate"] += 1
            return False
        self.tally.checked[candidate.kind] += 1
        seed = int(self.rng.integers(1 << 62))
        try:
            planned = check_candidate(self.scene, candidate, self.planner, self.settings.episode, seed)
        except InfeasibleTask as no:
            self.tally.dropped[str(no)] += 1
            return False
        self.tally.plannable[candidate.kind] += 1
        self._signatures.add(signature)
        self._of_kind[candidate.kind] += 1
        if len(candidate.actions) == 1:
            self.able.append(candidate.actions[0])
        self.found.append((planned, seed, proposed))
        self.on_checked(len(self.found))
        return True


def _task_key(scene: TaskScene, candidate: Candidate) -> Signature:
    """Return the key by which tasks of a scene are duplicates: predicates, categories, and values to two digits."""
    said = []
    for action in candidate.actions:
        literal, numbers = action.literal, (action.target, action.partner)
        of = [scene.pool.twin(scene.objects[number].twin_id).category for number in numbers if number is not None]
        said.append("|".join([literal.predicate, *of, "" if literal.value is None else f"{literal.value:.2g}"]))
    return tuple(said)
