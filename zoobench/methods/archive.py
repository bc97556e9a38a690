"""An archive of solutions that differ in their measures, as quality diversity finds them."""

import io
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from zoobench.arrays import Array


@dataclass(frozen=True)
class Archive:
    """The elites: the best solution in every cell of a grid over the measures, sorted by falling score.

    Attributes:
        params: `[elite_count, parameter_count]`.
        scores: `[elite_count]`, in the task's unit.
        measures: `[elite_count, measure_count]`, each in [0, 1].
        names: of the measures `[measure_count]`.
        cells: number of equal cells along each side of the grid.
    """

    params: Array
    scores: Array
    measures: Array
    names: tuple[str, ...]
    cells: int

    def arrays(self) -> dict[str, Any]:
        """The attributes as arrays by name, as they are stored."""
        return {item.name: np.array(getattr(self, item.name)) for item in fields(self)}

    def to_bytes(self) -> bytes:
        """The content of an NPZ file, bit for bit."""
        buffer = io.BytesIO()
        np.savez_compressed(buffer, **self.arrays())
        return buffer.getvalue()

    @classmethod
    def from_bytes(cls, data: bytes) -> "Archive":
        """The inverse of `to_bytes`."""
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            return cls(
                file["params"],
                file["scores"],
                file["measures"],
                tuple(str(name) for name in file["names"]),
                int(file["cells"]),
            )
