"""Fill states of a closed vessel: mass, centre of mass and inertia when empty, half full and full."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator

from manitwin.twin.record_values import LARGEST_KG, LARGEST_M, Finite, Matrix3, Record, Unit, Vector3


class FillState(Record):
    """A vessel filled to a share of its volume: mass, centre of mass (object frame) and inertia about it, as in ``Physical``.

    ``center_of_mass_uncertainty_m`` is the uncertainty of the centre of mass in this state; None in twins of earlier versions.
    """

    share: Unit
    mass_kg: Annotated[Finite, Field(gt=0, le=LARGEST_KG)]
    center_of_mass_m: Vector3
    center_of_mass_uncertainty_m: Annotated[Finite, Field(ge=0, le=LARGEST_M)] | None = None
    inertia_kg_m2: Matrix3


class Filling(Record):
    """The states of a vessel from empty to full, and the assumption behind them in words.

    ``center_of_mass_shift_m`` is the largest distance of the centre of mass from that of the full vessel, over all fill levels:
    the uncertainty of the centre of mass if the fill level is unknown. None in twins of earlier versions.
    """

    assumption: str = Field(min_length=1)
    states: list[FillState] = Field(min_length=2)
    center_of_mass_shift_m: Annotated[Finite, Field(ge=0, le=LARGEST_M)] | None = None

    @model_validator(mode="after")
    def _check_states(self) -> Filling:
        """Reject states that are out of order or physically impossible."""
        for less, more in zip(self.states, self.states[1:], strict=False):
            if not (less.share < more.share and less.mass_kg < more.mass_kg):
                raise ValueError("filling.states are not ordered from empty to full")
        for state in self.states:
            if not all(abs(place) <= LARGEST_M for place in state.center_of_mass_m):
                raise ValueError(f"filling: center_of_mass_m is {state.center_of_mass_m}, which is impossible")
            if not all(abs(moment) <= LARGEST_KG * LARGEST_M for row in state.inertia_kg_m2 for moment in row):
                raise ValueError("filling: inertia_kg_m2 is larger than that of any object")
        return self

    def state_at(self, share: float) -> FillState | None:
        """Return the state for a fill share; None if there is none."""
        return next((state for state in self.states if abs(state.share - share) < 1e-9), None)
