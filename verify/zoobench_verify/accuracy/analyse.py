"""How far trained gaits' scores at each fidelity are from those at the finest one, and which differences hold there.

Every environment and task is judged by itself, over the gaits of all designs. The reference of a gait is its score at
the finest level: the mean of two transfers where both were measured, since they head for the same limit. It is
uncertain by its distance to the farther of both, or to the score of gaits on a finer grid, if that is more. An error is
the root mean square difference to it over a design's gaits, as a share of the root mean square of the references, so
that a gait that hardly moves cannot inflate it; then over the designs.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from zoobench.accuracy.ladder import LADDER
from zoobench.accuracy.levels import LevelRow, components
from zoobench.registry import Kind, short
from zoobench.spec import FRAME_SECONDS
from zoobench_verify.accuracy.design_cell import DesignCell, rms, training_of
from zoobench_verify.accuracy.pairs import orders_of_one_body, orders_of_two_bodies
from zoobench_verify.accuracy.records import RANDOM, Measurements, Numbers, Sample, grid_spacing, is_present


@dataclass(frozen=True)
class MatrixRow:
    """Gaits found at one level and evaluated at another.

    Attributes:
        ratio: median of the scores at `evaluated` to those at `found`.
    """

    env: str
    task: str
    found: str
    evaluated: str
    gaits: int
    ratio: float


@dataclass(frozen=True)
class Analysis:
    """Results of the study: of trained gaits at the levels and with knobs turned, and of random controllers."""

    levels: tuple[LevelRow, ...]
    matrix: tuple[MatrixRow, ...]
    knobs: tuple[LevelRow, ...]
    random: tuple[LevelRow, ...]


def analyse(measurements: Measurements, envs: Sequence[str] = (), tasks: Sequence[str] = ()) -> Analysis:
    """Judge measurements, of some environments and tasks only if `envs` and `tasks` name them.

    Components of former versions are left out, and of episodes of several lengths the shorter ones.
    """
    places: dict[tuple[str, str], list[Sample]] = {}
    for sample in filter(is_present, measurements.samples):
        if (not envs or sample.env.name in envs) and (not tasks or sample.task.name in tasks):
            place = short(Kind.ENV, sample.env), short(Kind.TASK, sample.task)
            places.setdefault(place, []).append(sample)
    levels: list[LevelRow] = []
    knobs: list[LevelRow] = []
    random: list[LevelRow] = []
    matrix: list[MatrixRow] = []
    for place, samples in sorted(places.items()):
        trained = _cells(sample for sample in samples if sample.found != RANDOM)
        rows = _rows(place, trained)
        plain = [row for row in rows if row.fidelity in LADDER]
        judges = {name for cell in trained for name in cell.judges}
        levels += plain
        knobs += [row for row in rows if row.fidelity not in {*LADDER, *judges}]
        matrix += _matrix(place, trained)
        drawn = _rows(place, _cells(sample for sample in samples if sample.found == RANDOM))
        random += [row for row in drawn if row.fidelity in LADDER]
    return Analysis(tuple(levels), tuple(matrix), tuple(knobs), tuple(random))


def _cells(samples: Iterable[Sample]) -> list[DesignCell]:
    designs: dict[str, list[Sample]] = {}
    for sample in samples:
        designs.setdefault(short(Kind.DESIGN, sample.design), []).append(sample)
    longest = max((sample.frames for own in designs.values() for sample in own), default=0)
    return [DesignCell([sample for sample in own if sample.frames == longest]) for own in designs.values()]


def _rows(place: tuple[str, str], cells: Sequence[DesignCell]) -> list[LevelRow]:
    """A row for each fidelity, the levels first."""
    names = dict.fromkeys(name for cell in cells for name in cell.samples)
    ordered = [*(name for name in LADDER if name in names), *(name for name in names if name not in LADDER)]
    return [_row(place, name, [cell for cell in cells if name in cell.samples]) for name in ordered]


def _row(place: tuple[str, str], name: str, cells: Sequence[DesignCell]) -> LevelRow:
    samples = [sample for cell in cells for sample in cell.samples[name]]
    gaits = [gait for cell in cells for gait in cell.scores(name)]
    ratios = [ratio for cell in cells for ratio in cell.ratios(name)]
    low, median, high = np.percentile(ratios, (10, 50, 90)).tolist() if ratios else (None, None, None)

    def seconds(times: Callable[[Sample], Numbers]) -> list[float]:
        return [value / (sample.frames * FRAME_SECONDS) for sample in samples for value in times(sample).values()]

    memory = max(sample.peak_memory for sample in samples) / 2**20
    return LevelRow(
        env=place[0],
        task=place[1],
        fidelity=name,
        components=components(samples[0].env, samples[0].task, samples[0].fidelity),
        spacing=grid_spacing(samples[0].fidelity),
        bodies={cell.design: cell.bound(name) for cell in cells},
        gaits=len(gaits),
        runs=len({training_of(gait) for gait in gaits}),
        error=_rms_known([cell.error(name) for cell in cells]),
        unknown=_rms_known([cell.unknown for cell in cells]),
        checked=sum(cell.checked for cell in cells),
        low=low,
        median=median,
        high=high,
        transfer=_value(np.median, [ratio for cell in cells for ratio in cell.kept(name)]),
        one_body=orders_of_one_body(cells, name),
        two_bodies=orders_of_two_bodies(cells, name),
        angle=_value(np.mean, [angle for cell in cells for angle in cell.angles(name)]),
        particles=max(sample.particles for sample in samples),
        substeps=_value(np.mean, [sample.substeps for sample in samples]),
        seconds=_value(np.median, seconds(lambda sample: sample.seconds)),
        gradient_seconds=_value(np.median, seconds(lambda sample: sample.gradient_seconds)),
        memory=memory or None,
    )


def _matrix(place: tuple[str, str], cells: Sequence[DesignCell]) -> list[MatrixRow]:
    rows = []
    homes = {home for cell in cells for home in cell.found.values()}
    for home in (name for name in LADDER if name in homes):
        for name in (name for name in LADDER if any(name in cell.samples for cell in cells)):
            if ratios := [ratio for cell in cells for ratio in cell.carried(home, name)]:
                rows.append(MatrixRow(*place, home, name, len(ratios), float(np.median(ratios))))
    return rows


def _rms_known(values: Sequence[float | None]) -> float | None:
    """None if one of the values is."""
    known = [value for value in values if value is not None]
    return rms(known) if known and len(known) == len(values) else None


def _value(reduce: Callable[[list[float]], float], values: Sequence[float]) -> float | None:
    return float(reduce(list(values))) if values else None
