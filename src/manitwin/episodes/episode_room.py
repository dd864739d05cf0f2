"""Environment of an episode from its facts: furniture, lighting, fixtures, and granule size."""

from __future__ import annotations

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from manitwin.episodes.stored_episode import StoredEpisode
from manitwin.errors import EpisodesError
from manitwin.formats.printable import printable_line
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform
from manitwin.geometry.rigid_body import StaticBox
from manitwin.scenes.scene import Furniture, Light, Name, Number
from manitwin.twin.record_values import Quaternion


class FixtureBox(BaseModel):
    """One box of a fixture, in the world frame."""

    model_config = ConfigDict(frozen=True)

    name: Name
    half_extents_m: tuple[Number, Number, Number]
    position_m: tuple[Number, Number, Number]
    quaternion_wxyz: Quaternion


class _Fixture(BaseModel):
    model_config = ConfigDict(frozen=True)

    boxes: tuple[FixtureBox, ...]


class EpisodeRoom(BaseModel):
    """Furniture, lighting and fixtures stated by an episode's facts."""

    model_config = ConfigDict(frozen=True)

    furniture: Furniture
    ambient: tuple[Number, Number, Number]
    lights: tuple[Light, ...]
    fixtures: tuple[_Fixture, ...] = ()

    @property
    def fixture_boxes(self) -> list[StaticBox]:
        """The boxes of all fixtures."""
        return [
            StaticBox(
                box.name,
                np.array(box.half_extents_m),
                transform(rotation_from_quaternion_wxyz(np.array(box.quaternion_wxyz)), np.array(box.position_m)),
            )
            for fixture in self.fixtures
            for box in fixture.boxes
        ]


def episode_room(episode: StoredEpisode) -> EpisodeRoom:
    """Return the environment of an episode; raises EpisodesError for invalid facts."""
    try:
        return EpisodeRoom(**episode.facts)
    except (ValidationError, TypeError) as error:
        first = error.errors()[0] if isinstance(error, ValidationError) else {"loc": (), "msg": str(error)}
        where = printable_line(".".join(map(str, ("facts", *first["loc"]))), max_characters=80)
        said = f"episode {printable_line(episode.attempt.episode_id, max_characters=80)}: {where}: {first['msg']}"
        raise EpisodesError(f"{said}; write the episodes again") from error


def granules_of(episode: StoredEpisode) -> tuple[int, float] | None:
    """Return number and radius (m) of an episode's granules, None without any; raises EpisodesError for an invalid radius."""
    positions, radius_m = episode.recording.granule_positions_m, episode.facts.get("granule_radius_m")
    if positions is None:
        return None
    if not isinstance(radius_m, float) or not 0 < radius_m < 1:
        name = printable_line(episode.attempt.episode_id, max_characters=80)
        raise EpisodesError(f"episode {name}: no radius of its granules; make it again")
    return positions.shape[1], radius_m
