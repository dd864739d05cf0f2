"""Validators of fields in a JSON request; each returns an error message, or None for a valid value."""

from __future__ import annotations

import base64
import binascii
import io
from collections.abc import Callable, Mapping
from typing import Any

from PIL import Image, UnidentifiedImageError

Check = Callable[[Any], str | None]


def one_of(*valid: Any) -> Check:
    """Accept one of the given values."""
    return lambda value: None if value in valid else f"must be one of {', '.join(map(str, valid))}"


def list_of(*valid: Any) -> Check:
    """Accept a non-empty list of the given values."""
    return lambda value: (
        None
        if isinstance(value, list) and value and all(part in valid for part in value)
        else f"must be a list of {', '.join(map(str, valid))}"
    )


def whole(low: int, high: int) -> Check:
    """Accept an integer within a closed range."""

    def check(value: Any) -> str | None:
        is_whole = isinstance(value, int) and not isinstance(value, bool)
        return None if is_whole and low <= value <= high else f"must be an integer from {low} to {high}"

    return check


def number(low: float, high: float) -> Check:
    """Accept a number within a closed range."""

    def check(value: Any) -> str | None:
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        return None if is_number and low <= value <= high else f"must be a number from {low:g} to {high:g}"

    return check


def flag(value: Any) -> str | None:
    """Accept true or false."""
    return None if isinstance(value, bool) else "must be true or false"


def text(longest: int) -> Check:
    """Accept a non-empty string of at most ``longest`` characters."""

    def check(value: Any) -> str | None:
        return None if isinstance(value, str) and 0 < len(value) <= longest else f"must be 1 to {longest} characters"

    return check


def picture_url(value: Any) -> str | None:
    """Accept an https URL, or a data URI of a PNG or JPEG."""
    if isinstance(value, str) and value.startswith("https://"):
        return None
    head, _, data = value.partition(",") if isinstance(value, str) else ("", "", "")
    if head not in ("data:image/png;base64", "data:image/jpeg;base64"):
        return "must be an https URL or a data URI of a PNG or JPEG"
    return picture_base64(data)


def picture_base64(value: Any) -> str | None:
    """Accept the base64 of a picture without the prefix of a data URI."""
    try:
        Image.open(io.BytesIO(base64.b64decode(value, validate=True))).load()
    except (binascii.Error, TypeError, ValueError, UnidentifiedImageError, OSError):
        return "must be the base64 of a picture"
    return None


def complaint(body: Any, fields: Mapping[str, Check], required: tuple[str, ...]) -> tuple[str, str] | None:
    """Return the first invalid field and its error message; None if the body is valid."""
    if not isinstance(body, dict):
        return "body", "must be a JSON object"
    for name in required:
        if name not in body:
            return name, "is required"
    for name, value in body.items():
        if name not in fields:
            return name, "is not a known field"
        wrong = fields[name](value)
        if wrong:
            return name, wrong
    return None
