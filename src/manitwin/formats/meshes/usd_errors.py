"""Errors of the USD library as one readable line."""

from __future__ import annotations

import re

from pxr import Tf

from manitwin.formats.printable import printable_line

_SAID = re.compile(r"at line \d+ in file \S+ : '(.*?)\s*'\s*(?=\n\s*Error in|\Z)", re.DOTALL)
"""The form of Tf errors: the location in USD's own source, and the message."""
_ITS_OWN_NAMES = re.compile(r"\bpxrInternal\w*::(?:\w+::)*")
_PLACE = re.compile(r"^\S*:(\d+):\d+: ")
_CHARACTERS = 160


def cause_of(error: Tf.ErrorException) -> str:
    """Return the first message of USD, with the line of the file if stated; "" if there is none."""
    said = [_ITS_OWN_NAMES.sub("", " ".join(each.split())) for each in _SAID.findall(_text_of(error))]
    if not said:
        return ""
    placed = next((each for each in said if _PLACE.match(each)), None)
    line = said[0] if placed is None else _PLACE.sub(r"line \1: ", placed)
    return printable_line(line, max_characters=_CHARACTERS)


def broken_usd_cause(error: Tf.ErrorException) -> str:
    """Return the cause for an error message about broken USD."""
    cause = cause_of(error)
    return f"its USD is broken ({cause})" if cause else "its USD is broken"


def _text_of(error: Tf.ErrorException) -> str:
    """Return all messages of USD, which may repeat bytes of the file that are not valid text."""
    try:
        return str(error)
    except UnicodeDecodeError as undecoded:
        return undecoded.object.decode("utf-8", "replace")
