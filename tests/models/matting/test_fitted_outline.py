"""A roughly drawn outline moves onto the edges near it, and no farther."""

import numpy as np

from manitwin.models.matting.fitted_outline import fit_outline


def disk(side_px: int, radius_px: float) -> np.ndarray:
    rows, columns = np.mgrid[:side_px, :side_px] - side_px / 2
    return np.asarray(np.hypot(rows, columns) < radius_px)


def photo_of(mask: np.ndarray) -> np.ndarray:
    """Return a photo of a thing with grain, and of its ground with some."""
    grain = np.random.default_rng(0).normal(0, 6, (*mask.shape, 3))
    plain = np.where(mask[..., None], [150.0, 90, 60], [190.0, 190, 185])
    return np.clip(plain + grain, 0, 255).astype(np.uint8)


def iou(one: np.ndarray, other: np.ndarray) -> float:
    return float((one & other).sum() / (one | other).sum())


def test_outline_drawn_outside_or_inside_moves_onto_the_edge() -> None:
    for side_px in (300, 900):  # smaller and larger than what it works on
        truth = disk(side_px, 0.3 * side_px)
        for rough in (disk(side_px, 0.323 * side_px), disk(side_px, 0.278 * side_px)):
            fitted = fit_outline(photo_of(truth), rough)
            assert iou(rough, truth) < 0.87 and iou(fitted, truth) > 0.98
            assert (fitted == fit_outline(photo_of(truth), rough)).all()


def test_what_is_far_from_the_outline_stays_as_it_was_drawn() -> None:
    truth = disk(300, 90)
    photo = photo_of(truth)
    photo[140:160, 140:160] = photo[5, 5]  # a spot of the ground's colour within
    photo[5:25, 5:25] = photo[150, 100]
    fitted = fit_outline(photo, truth)
    assert fitted[140:160, 140:160].all() and not fitted[5:25, 5:25].any()


def test_nothing_and_everything_are_left_as_they_are() -> None:
    photo = photo_of(disk(80, 20))
    for mask in (np.zeros((80, 80), bool), np.ones((80, 80), bool)):
        assert (fit_outline(photo, mask) == mask).all()
    spot = np.zeros((80, 80), bool)
    spot[40, 40] = True
    assert fit_outline(photo, spot).shape == (80, 80)
