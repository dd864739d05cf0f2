"""Collection of a run's batches: the table of attempts, a LeRobot data set, and a ManiSkill file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from manitwin.episodes.attempts import ATTEMPTS, AttemptCounts, count_attempts, merge_attempts, read_attempts
from manitwin.episodes.batch import BATCH_RECORD, BATCHES, REMEDY_OF_REPEATS, read_batch
from manitwin.episodes.episodes_stage import EPISODES
from manitwin.episodes.hdf5_file import EpisodeFile, has_granules
from manitwin.episodes.hdf5_merge import merge_episodes
from manitwin.episodes.lerobot.write import write_lerobot
from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import EpisodesError, UsageError, unknown_name_message

LEROBOT, MANISKILL = "lerobot", "maniskill"
FORMATS = (LEROBOT, MANISKILL)
MOST_NAMED = 10


@dataclass(frozen=True)
class AttemptTotals:
    """Counts of all attempts of a run; ``without_success`` are the twins without a successful episode."""

    attempted: int
    planned: int
    succeeded: int
    kept: int
    outcomes: dict[str, int]
    without_success: list[str]


@dataclass(frozen=True)
class CollectionSummary:
    """Summary lines for the end of a run, and the numbers in them."""

    lines: list[str]
    totals: AttemptTotals


def chosen_formats(given: Iterable[str]) -> list[str]:
    """Return the formats of these names; raises UsageError naming the valid ones."""
    names = [name.strip() for name in given if name.strip()]
    for name in names:
        if name not in FORMATS:
            raise UsageError(unknown_name_message("format", name, FORMATS))
    return names


def batch_folders(out: Path) -> list[Path]:
    """Return the finished batches of a run, ordered by episode numbers.

    Raises UsageError if there are none, EpisodesError for a batch that cannot be read or has a newer version, and if two
    batches contain the same episode number, and thus the same seed.
    """
    folders = [path.parent for path in sorted((out / BATCHES).glob(f"*/*/{BATCH_RECORD}"))]
    if not folders:
        raise UsageError(f"{out}: no episodes found; create some with `manitwin trajectories`")
    of, first = dict[str, Path](), dict[Path, str]()
    for folder in folders:
        read_batch(folder)
        for attempt in read_attempts(folder / ATTEMPTS):
            number = attempt.episode_id.rpartition("-")[2]
            other = of.setdefault(number, folder)
            if other != folder:
                raise EpisodesError(f"{folder}: repeats episode {number} of {other}; {REMEDY_OF_REPEATS}")
            first[folder] = min(number, first.get(folder, number))
    return sorted(folders, key=lambda folder: first.get(folder, ""))


def stored_episodes(folders: Iterable[Path]) -> Iterator[StoredEpisode]:
    """Yield the kept episodes of batches, one at a time."""
    for folder in folders:
        with EpisodeFile(folder / EPISODES) as file:
            yield from file


def any_granules(folders: Iterable[Path]) -> bool:
    """Tell whether any kept episode of the batches has granules."""
    for folder in folders:
        with EpisodeFile(folder / EPISODES) as file:
            if any(has_granules(file.content, f"traj_{number}") for number in range(len(file))):
                return True
    return False


def collect(out: Path, formats: list[str]) -> CollectionSummary:
    """Write the table of attempts and the data sets of the kept episodes, each atomically."""
    folders = batch_folders(out)
    _, kept = merge_attempts([folder / ATTEMPTS for folder in folders], out / ATTEMPTS)
    if MANISKILL in formats:
        merge_episodes([folder / EPISODES for folder in folders], out / MANISKILL)
    if LEROBOT in formats and kept:
        write_lerobot(stored_episodes(folders), out / LEROBOT, granules=any_granules(folders))
    return _collected(out)


def _whose_grasps(success: AttemptCounts) -> list[str]:
    """Return lines on the number of episodes with grasps verified for another gripper, with the remedy."""
    if not success.transferred:
        return []
    return [
        f"{success.transferred} of {success.total.executed} executed episodes used grasps that were verified for"
        f" other jaws, not for the robot's gripper",
        "  remedy: build the twins for this gripper too: manitwin build --gripper, see docs/grippers.md",
    ]


def _planning_failure_lines(success: AttemptCounts) -> list[str]:
    """Return lines on planning failures and on twins without grasps for the hand, with the remedy."""
    lines = []
    if failures := success.plan_failures:
        total = sum(failures.values())
        counted = ", ".join(f"{count} {reason}" for reason, count in failures.items())
        lines.append(f"why no_plan: of {total} grasps and poses that were tried {counted}")
    if lacking := success.without_grasp:
        named = ", ".join(f"{twin_id} {category}" for twin_id, category in lacking[:MOST_NAMED])
        more = f" and {len(lacking) - MOST_NAMED} more" if len(lacking) > MOST_NAMED else ""
        lines.append(f"why no_grasp: there is no verified grasp for the robot's hand for {named}{more}")
        lines.append("  remedy: build the twins for this gripper too: manitwin build --gripper, see docs/grippers.md")
    return lines


def _collected(out: Path) -> CollectionSummary:
    success = count_attempts(read_attempts(out / ATTEMPTS))
    total, outcomes = success.total, dict(sorted(success.outcomes.items()))
    failed = ", ".join(f"{count} {outcome}" for outcome, count in outcomes.items() if outcome != "kept")
    lines = [
        f"{total.attempted} attempted, {total.executed} planned and executed, {total.succeeded} succeeded"
        f" ({total.succeeded / max(1, total.executed):.1%} of the executed), {total.kept} kept",
        f"not kept: {failed or 'none'}",
        *_whose_grasps(success),
        *_planning_failure_lines(success),
    ]
    if success.never:
        lines.append("no success with: " + ", ".join(f"{twin_id} {category}" for twin_id, category in success.never))
    totals = AttemptTotals(
        total.attempted,
        total.executed,
        total.succeeded,
        total.kept,
        outcomes,
        [twin_id for twin_id, _ in success.never],
    )
    return CollectionSummary(lines, totals)
