"""What a closed vessel weighs empty, half full and full, and where its centre of mass then is."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from manitwin.twin.record_values import LARGEST_KG, LARGEST_M, Finite, Matrix3, Record, Unit, Vector3


class FillState(Record):
    """A vessel filled to a share of its volume: mass, centre of mass (object frame) and inertia about it, as of ``Physical``.

    ``center_of_mass_uncertainty_m``: how far the centre of mass may be off in this state; None in twins made without it.
    """

    share: Unit
    mass_kg: Annotated[Finite, Field(gt=0, le=LARGEST_KG)]
    center_of_mass_m: Vector3
    center_of_mass_uncertainty_m: Annotated[Finite, Field(ge=0, le=LARGEST_M)] | None = None
    inertia_kg_m2: Matrix3


class Filling(Record):
    """A vessel's states from empty to full, and the assumption that they rest on, in words.

    ``center_of_mass_shift_m``: how far from that of the full one the centre of mass is at most, at any level; where nobody knows
    how full a vessel is, its centre of mass is uncertain by so much. None in twins that were made without it.
    """

    assumption: str = Field(min_length=1)
    states: list[FillState] = Field(min_length=2)
    center_of_mass_shift_m: Annotated[Finite, Field(ge=0, le=LARGEST_M)] | None = None

    @model_validator(mode="after")
    def _possible(self) -> Filling:
        """Refuse states that are not in order, or that no vessel has."""
        for less, more in zip(self.states, self.states[1:], strict=False):
            if not (less.share < more.share and less.mass_kg < more.mass_kg):
                raise ValueError("filling.states are not ordered from empty to full")
        for state in self.states:
            if not all(abs(place) <= LARGEST_M for place in state.center_of_mass_m):
                raise ValueError(f"filling: center_of_mass_m is {state.center_of_mass_m}, which is impossible")
            if not all(abs(moment) <= LARGEST_KG * LARGEST_M for row in state.inertia_kg_m2 for moment in row):
                raise ValueError("filling: inertia_kg_m2 is larger than that of any object")
        return self

    def at(self, share: float) -> FillState | None:
        """Return the state of a share, None where there is none."""
        return next((state for state in self.states if abs(state.share - share) < 1e-9), None)
