"""What is refused before a build begins, of texts whose name is that of another thing."""

from __future__ import annotations

import pytest

from manitwin.config import BuildConfig
from manitwin.pipeline.generator_input import make_input_check
from manitwin.pipeline.item import Item


@pytest.mark.parametrize(
    ("text", "name", "refused"),
    [
        ("a red mug", "fork", True),
        ("a red mug", "mug", False),
        ("a red mug", "my favourite coffee mug", False),
        ("a red mug", "Robert", False),
        ("a red mug", None, False),
        ("a coffee mug, 9 cm tall", "cup", False),
        ("a jam jar", "jar", False),
    ],
)
def test_a_text_is_not_built_under_the_name_of_another_thing(text: str, name: str | None, refused: bool) -> None:
    why = make_input_check(BuildConfig())(Item(file=None, text=text, name=name))
    assert (why is not None) == refused
    if why is not None:
        assert repr(name) in why and "leave out the name" in why
