"""Pictures of whole numbers, as PNG."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.formats.label_picture import label_picture, parse_label_picture


@pytest.mark.parametrize("most", [200, 60_000])
def test_numbers_are_read_as_they_were_written(most: int) -> None:
    numbers = np.random.default_rng(0).integers(0, most, (12, 17))
    again = parse_label_picture(label_picture(numbers), "ids.png", UsageError, remedy="draw it again")
    assert np.array_equal(again, numbers)


@pytest.mark.parametrize("content", [b"", b"no picture", b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff\xe0" + bytes(40)])
def test_what_is_no_png_is_one_line_without_an_address(content: bytes) -> None:
    with pytest.raises(UsageError, match=r"ids\.png: is not a readable PNG") as caught:
        parse_label_picture(content, "ids.png", UsageError, remedy="draw it again")
    assert "0x" not in str(caught.value) and "\n" not in str(caught.value)


def test_half_a_png_is_refused() -> None:
    content = label_picture(np.random.default_rng(1).integers(0, 255, (64, 64)))
    with pytest.raises(UsageError, match="draw it again"):
        parse_label_picture(content[: len(content) // 2], "ids.png", UsageError, remedy="draw it again")
