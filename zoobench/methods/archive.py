"""An archive: what a method has found beside the best, good solutions of every kind."""

import io
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from zoobench.arrays import Array


@dataclass(frozen=True)
class Archive:
    """The best of every cell of a grid over what solutions are measured by; the elites, the best of all first.

    Attributes:
        params: `[elite_count, parameter_count]`.
        scores: `[elite_count]`, in the task's unit.
        measures: `[elite_count, measure_count]`, each in [0, 1].
        names: of the measures `[measure_count]`.
        cells: along each side of the grid, which divides [0, 1] evenly.
    """

    params: Array
    scores: Array
    measures: Array
    names: tuple[str, ...]
    cells: int

    def arrays(self) -> dict[str, Any]:
        """All of it as arrays by name, as they are stored."""
        return {item.name: np.array(getattr(self, item.name)) for item in fields(self)}

    def to_bytes(self) -> bytes:
        """As an NPZ file, exact to the last bit."""
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
