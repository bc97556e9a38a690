"""Storage of archives."""

import numpy as np

from zoobench.methods.archive import Archive


def test_an_archive_survives_its_bytes() -> None:
    """Every array bit for bit, names and size."""
    rng = np.random.default_rng(0)
    archive = Archive(rng.normal(size=(7, 5)), rng.normal(size=7), rng.random((7, 2)), ("volume", "elongation"), 50)
    back = Archive.from_bytes(archive.to_bytes())
    assert (back.names, back.cells) == (archive.names, archive.cells)
    for name in ("params", "scores", "measures"):
        np.testing.assert_array_equal(getattr(back, name), getattr(archive, name))
