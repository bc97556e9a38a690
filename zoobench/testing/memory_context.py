"""A run context in memory, for tests of methods."""

import numpy as np

from zoobench.arrays import Array


class MemoryContext:
    """Keeps the reports of a method.

    Attributes:
        stored: the last checkpoint; None before the first.
        curve: the points of the learning curve, without times.
        seconds: the times of the same, apart, since two runs do not share them [s].
        fractions: the completed fractions that were reported.
        milestones: iterations, score and parameters of each.
    """

    def __init__(self, seed: int = 0, stored: bytes | None = None, stop_after: int | None = None) -> None:
        """Begin from the checkpoint `stored`, and ask to stop after `stop_after` points of the learning curve."""
        self.rng = np.random.default_rng(seed)
        self.stored, self.stop_after = stored, stop_after
        self.curve: list[tuple[int, dict[str, float]]] = []
        self.seconds: list[float] = []
        self.fractions: list[float] = []
        self.milestones: list[tuple[int, float, Array]] = []

    def report(self, step: int, **metrics: float) -> None:
        """Put a point on the curve."""
        if "seconds" in metrics:
            self.seconds.append(metrics.pop("seconds"))
        metrics.pop("cpu_seconds", None)
        self.curve.append((step, metrics))

    def milestone(self, step: int, score: float, params: Array) -> None:
        """Keep a copy of the parameters."""
        self.milestones.append((step, score, params.copy()))

    def checkpoint(self, data: bytes) -> None:
        """Replace the stored state."""
        self.stored = data

    def restore(self) -> bytes | None:
        """The stored state."""
        return self.stored

    def should_stop(self) -> bool:
        """Whether the curve has `stop_after` points."""
        return self.stop_after is not None and len(self.curve) >= self.stop_after

    def progress(self, fraction: float, score: float | None) -> None:
        """Keep the fraction."""
        self.fractions.append(fraction)
