"""Files of an archive of quality-diversity: a table, a map, or all arrays."""

import csv
from pathlib import Path
from typing import Protocol

import numpy as np

from zoobench.arrays import Array
from zoobench.errors import UsageError, reason
from zoobench.render import figures


class Elites(Protocol):
    """The elites of a run, the best first, as a method's `Archive` has them."""

    @property
    def scores(self) -> Array:
        """`[elite_count]`."""

    @property
    def measures(self) -> Array:
        """Measures in [0, 1] `[elite_count, measure_count]`."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the measures."""

    @property
    def cells(self) -> int:
        """Number of cells along each measure."""

    def to_bytes(self) -> bytes:
        """All arrays, as a file of NumPy."""


_SIZE = (6.4, 5.2)  # [inches]


def write(archive: Elites, path: Path, *, title: str, unit: str) -> None:
    """Write an archive in the format that the path's ending names; elites are numbered from 1, the best first.

    * `csv`: a row for each elite, its number, score and measures.
    * `npz`: the arrays of the archive by name, parameters included.
    * `png`: a map of the cells by score; white ones are empty, and a star marks the best.

    Raises:
        UsageError: unknown ending, the file cannot be written, or matplotlib is not installed (`png`).
    """
    kind = path.suffix.lower()
    if kind not in (".csv", ".npz", ".png"):
        raise UsageError(f"{str(path)!r} ends in {path.suffix!r}. Give a file that ends in .csv, .npz or .png.")
    try:
        if kind == ".csv":
            _csv(archive, path, unit)
        elif kind == ".npz":
            path.write_bytes(archive.to_bytes())
        else:
            _png(archive, path, title, unit)
    except OSError as error:
        raise UsageError(f"{str(path)!r} cannot be written: {reason(error)}. Give another file.") from None


def _csv(archive: Elites, path: Path, unit: str) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["elite", f"score [{unit}]", *archive.names])
        for number, (score, measures) in enumerate(zip(archive.scores, archive.measures, strict=True), start=1):
            writer.writerow([number, repr(float(score)), *(repr(float(value)) for value in measures)])


def cells_of(archive: Elites) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Indices of the grid cell of each elite `[elite_count, measure_count]`; a measure of 1 belongs to the last."""
    return np.minimum((archive.measures * archive.cells).astype(np.int64), archive.cells - 1)


def _png(archive: Elites, path: Path, title: str, unit: str) -> None:
    scores = np.full((archive.cells, archive.cells), np.nan)
    across, up = cells_of(archive).T
    scores[up, across] = archive.scores
    figure = figures.blank(_SIZE)
    axes = figure.add_subplot()
    edges = np.linspace(0.0, 1.0, archive.cells + 1)
    image = axes.pcolormesh(edges, edges, np.ma.masked_invalid(scores), cmap="viridis")
    figure.colorbar(image, label=f"score [{unit}]")
    axes.plot((across[0] + 0.5) / archive.cells, (up[0] + 0.5) / archive.cells, "*", ms=14, mfc="w", mec="k")
    axes.set(title=title, xlabel=f"{archive.names[0]} [1]", ylabel=f"{archive.names[1]} [1]", aspect="equal")
    figures.save(figure, path)
