"""The built-in generator that needs no weights: see ``lifting`` for how it chooses."""

from manitwin.models.generators.lift.generator import LiftGenerator

__all__ = ["LiftGenerator"]
