from pathlib import Path

import numpy as np
import pytest

from manitwin.errors import InputError
from manitwin.formats.meshes import obj_faces
from manitwin.formats.meshes.obj_faces import Faces, plain_corners
from manitwin.formats.meshes.source import MeshLimits, MeshSource

FORMS = ("{0}", "{0}/{1}", "{0}//{2}", "{0}/{1}/{2}")


def faces_of(lines: list[str], counts: tuple[int, int, int] = (0, 0, 0)) -> Faces:
    faces = Faces(MeshSource(Path("faces.obj"), MeshLimits()))
    for number, said in enumerate(lines, start=1):
        faces.add(number, f"f {said}\n", said, len(said.split()), counts)
    return faces


@pytest.mark.parametrize("form", FORMS)
def test_what_is_read_at_once_is_what_is_read_one_by_one(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(FORMS.index(form))
    lines = [
        "  ".join(form.format(*rng.integers(1, 2000, 3)) for _ in range(corners)) for corners in rng.integers(3, 9, 200)
    ]
    assert plain_corners(" ".join(lines)) is not None
    at_once = faces_of(lines).rows()
    monkeypatch.setattr(obj_faces, "plain_corners", lambda text: None)
    for said, true in zip(at_once, faces_of(lines).rows(), strict=True):
        np.testing.assert_array_equal(said, true)


@pytest.mark.parametrize(
    "text",
    [
        *(
            "1//2 3/4",
            "1/2 3/4/5",
            "1/2/ 3/4/",
            "1/2/ 3/4/5/6",
            "//12 1/2/3",
            "1//2 //3",
            "//",
            "1/ 2/",
            "/1 /2",
            "1 2 3a",
        ),
        *("0 1 2", "1 2 -3", "1.0 2 3", "1 2 99999999999999999999999", "1/2/3/4 5/6/7/8", "1 2 3\t4", "١ 2 3"),
    ],
)
def test_corners_of_mixed_or_broken_forms_are_not_read_at_once(text: str) -> None:
    assert plain_corners(text) is None


def test_faces_that_count_back_stay_where_they_are_among_others() -> None:
    sizes, corners = faces_of(["1 2 3", "-1 -2 -3 -4", "4 5 6", "7 8", "9 10 11"], counts=(20, 0, 0)).rows()
    assert sizes.tolist() == [3, 4, 3, 3], "an edge is no face"
    assert corners[:, 0].tolist() == [0, 1, 2, 19, 18, 17, 16, 3, 4, 5, 8, 9, 10]
    assert (corners[:, 1:] == -1).all()


def test_a_broken_line_among_plain_ones_is_named() -> None:
    faces = faces_of(["1 2 3", "4 5 6", "7 8 x"])
    with pytest.raises(InputError, match=r"line 3 is not a face: 'f 7 8 x"):
        faces.rows()


def test_no_face_gives_no_rows() -> None:
    assert [len(rows) for rows in faces_of(["1 2"]).rows()] == [0, 0]
