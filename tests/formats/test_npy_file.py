import io

import numpy as np
import pytest

from manitwin.errors import TwinError
from manitwin.formats.npy_file import labels_to_npy, parse_labels

LABELS = np.array([0, 1, 255, 3], np.uint8)


def saved(array: np.ndarray, **options: bool) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, **options)
    return stream.getvalue()


def test_labels_are_read_as_written_and_by_numpy() -> None:
    content = labels_to_npy(LABELS)
    assert np.array_equal(parse_labels(content, "x.npy", TwinError, remedy="build it again"), LABELS)
    assert np.array_equal(np.load(io.BytesIO(content), allow_pickle=False), LABELS)
    assert content == labels_to_npy(LABELS[::1].copy()) == saved(LABELS)
    assert not len(parse_labels(labels_to_npy(LABELS[:0]), "x.npy", TwinError, remedy="build it again"))


WRONG = {
    "empty": b"",
    "cut off": labels_to_npy(LABELS)[:-1],
    "more than it says": labels_to_npy(LABELS) + b"\0",
    "wider numbers": saved(LABELS.astype(np.uint16)),
    "a table": saved(LABELS.reshape(2, 2)),
    "objects": saved(np.array([{}]), allow_pickle=True),
    "a longer header": labels_to_npy(LABELS).replace(b"\x76\x00", b"\xff\xff", 1),
    "code for a header": labels_to_npy(LABELS).replace(b"(4,)", b"f(4)"),
}


@pytest.mark.parametrize("what", WRONG)
def test_all_else_is_refused_in_one_line(what: str) -> None:
    with pytest.raises(TwinError, match=r"^x\.npy: [^\n]*; build it again$"):
        parse_labels(WRONG[what], "x.npy", TwinError, remedy="build it again")
