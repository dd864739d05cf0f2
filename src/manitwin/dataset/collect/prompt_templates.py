"""Prompt templates that ask a text-to-image or text-to-3D model for a single object of a category."""

from __future__ import annotations

import re

import numpy as np

from manitwin.models.annotators.prior_records import Prior

COLORS = ("black", "white", "grey", "red", "orange", "yellow", "green", "blue", "purple", "brown", "beige", "turquoise")

SENTENCES = (
    "a {thing}",
    "a {color} {thing}",
    "a {thing} of {material}",
    "a {color} {thing} of {material}",
    "a plain {color} {thing} without text",
    "a used {thing} of {material}, slightly worn",
    "a new {color} {thing}",
    "a small {color} {thing}, {small_cm} cm",
    "a large {color} {thing}, {large_cm} cm",
    "a {thing} of {typical_cm} cm, {color}",
    "a matte {color} {thing} of {material}",
    "a glossy {color} {thing}",
    "a {color} and {other_color} {thing}",
    "a simple, sturdy {thing} of {material}",
    "a {thing} with rounded edges, {color}",
)
"""Templates that describe one object only. Background and lighting are added by the code that requests pictures."""


def format_prompt(prior: Prior, number: int, rng: np.random.Generator) -> str:
    """Return template ``number`` of ``SENTENCES`` for a category; colours are random, material and sizes are those of
    the prior.
    """
    color, other_color = rng.choice(COLORS, 2, replace=False)
    size = prior.longest_axis_m
    said = SENTENCES[number].format(
        thing=f"{prior.counter} {prior.category}" if prior.counter else prior.category,
        material=prior.material,
        color=color,
        other_color=other_color,
        small_cm=_cm(size.low),
        typical_cm=_cm(size.typical),
        large_cm=_cm(size.high),
    )
    return re.sub(r"\ba (?=[aeiou])", "an ", said)


def _cm(length_m: float) -> str:
    return f"{100 * length_m:.2g}"
