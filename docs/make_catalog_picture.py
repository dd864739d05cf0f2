"""Make catalog.png beside this file: twins of a data set, each in three of a catalogue's views.

manitwin build samples/samples.csv -o demo
python docs/make_catalog_picture.py demo
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from picture_file import of_twin, save_picture
from PIL import Image

from manitwin.dataset.catalog.surface import views_around
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin

DOCS = Path(__file__).resolve().parent
SIZE_PX, SIDES, ACROSS = 180, (1, 11, 20), 2


def main() -> None:
    """Draw the twins of the given data set."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("dataset", type=Path)
    root = DatasetRoot(parser.parse_args().dataset)
    assert root.local is not None
    twins = [Twin(root.local / root.twin_name(each)) for each in root.twin_ids()]
    rows = [
        np.concatenate([views_around(twin, SIZE_PX)[side].rgb for side in SIDES], axis=1)
        for twin in twins
        if twin.record.status == "accepted"
    ]
    rows = rows[: len(rows) // ACROSS * ACROSS]
    columns = [np.concatenate(rows[begin::ACROSS], axis=0) for begin in range(ACROSS)]
    save_picture(
        Image.fromarray(np.concatenate(columns, axis=1)),
        DOCS / "catalog.png",
        {twin.record.twin_id: of_twin(twin.record) for twin in twins},
    )


if __name__ == "__main__":
    main()
