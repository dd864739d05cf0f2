from __future__ import annotations

import pytest

from manitwin.formats.markdown import markdown_escaped


@pytest.mark.parametrize(
    ("words", "shown"),
    [
        ("a *bold* `mug` | [x](y)", r"a \*bold\* \`mug\` \| \[x\](y)"),
        ("<img src=x> & co", "&lt;img src=x&gt; &amp; co"),
        ("# one\n two\x1b[31m\u2028three", r"\# one two \[31m three"),
        ("Becher für Öl", "Becher für Öl"),
    ],
)
def test_words_of_an_outsider_are_one_line_that_does_nothing(words: str, shown: str) -> None:
    assert markdown_escaped(words) == shown
