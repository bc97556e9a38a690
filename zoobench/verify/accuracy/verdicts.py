"""Verdicts on the measurements: the gain of one more level, the effect of each knob, the energy balance."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter

from zoobench.registry import Kind
from zoobench.verify.accuracy.analyse import Analysis, LevelRow
from zoobench.verify.accuracy.records import Measurements, grid_spacing, label


@dataclass(frozen=True)
class RefinementRow:
    """Gain and cost of the next finer level.

    Attributes:
        error, next_error: of the score; None where unknown.
        gain: their ratio.
        cost: wall time per simulated second of the next level by that of this one.
        tau, next_tau: rank correlations.
    """

    env: str
    task: str
    level: str
    next_level: str
    error: float | None
    next_error: float | None
    gain: float | None
    cost: float | None
    tau: float | None
    next_tau: float | None


@dataclass(frozen=True)
class KnobRow:
    """Effect and cost of turning one knob at its level.

    Attributes:
        error, home_error: of the score, with the knob turned and at the unchanged level.
        change: difference of the scores to those of the unchanged level.
        cost: wall time per simulated second by that of the unchanged level.
        effect: `no difference` if the scores change by less than the noise floor, `better` or `worse` if the error
            does by more, else `other`.
        verdict: the effect and its cost.
    """

    env: str
    task: str
    home: str
    knob: str
    error: float | None
    home_error: float | None
    change: float | None
    floor: float | None
    angle: float | None
    cost: float | None
    effect: str
    verdict: str


@dataclass(frozen=True)
class EnergyRow:
    """The energy balance of a short episode, as shares of the work put in by the muscles, `put_in` [J].

    Attributes:
        back: work taken back by stretched muscles.
        stored: growth of kinetic, elastic and potential energy.
        viscous, plastic, contact: lost to viscosity, to yield, to ground and walls.
        unexplained: lost without a physical cause; negative for a gain.
    """

    env: str
    fidelity: str
    put_in: float
    back: float
    stored: float
    viscous: float
    plastic: float
    contact: float
    unexplained: float


def energies(measurements: Measurements, envs: Sequence[str] = ()) -> Iterator[EnergyRow]:
    """Balances of `envs` (all if empty) by environment, from coarse to fine, each level before its knobs."""
    chosen = [
        (one.env.name, -grid_spacing(one.fidelity), label(Kind.FIDELITY, one.fidelity), label(Kind.ENV, one.env), one)
        for one in measurements.balances
        if one.put_in and (not envs or one.env.name in envs)
    ]
    for *_, fidelity, env, one in sorted(chosen, key=itemgetter(0, 1, 2, 3)):
        parts = (one.stored, one.viscous, one.plastic, one.contact)
        stored, viscous, plastic, contact = (energy / one.put_in for energy in parts)
        back = 1.0 - one.muscles / one.put_in
        yield EnergyRow(env, fidelity, one.put_in, back, stored, viscous, plastic, contact, one.unexplained)


def steps(analysis: Analysis) -> Iterator[RefinementRow]:
    """Every pair of neighbouring levels."""
    for one, two in pairwise(analysis.levels):
        if (one.env, one.task) != (two.env, two.task):
            continue
        gain, cost = _ratio(one.error, two.error), _ratio(two.seconds, one.seconds)
        yield RefinementRow(
            one.env, one.task, one.fidelity, two.fidelity, one.error, two.error, gain, cost, one.tau, two.tau
        )


def knobs(analysis: Analysis) -> Iterator[KnobRow]:
    """Every turned knob, compared with its unchanged level."""
    homes = {(row.env, row.task, row.fidelity): row for row in analysis.levels}
    for row in analysis.knobs:
        env, fidelity = row.env.partition("[")[0], row.fidelity.partition("[")[0]
        home = homes.get((env, row.task, fidelity))
        if home is None:
            continue
        changed = row.fidelity if row.fidelity != fidelity else row.env
        cost = _ratio(row.seconds, home.seconds)
        effect = _effect(row, home)
        yield KnobRow(
            env=env,
            task=row.task,
            home=fidelity,
            knob=changed.partition("[")[2].rstrip("]"),
            error=row.error,
            home_error=home.error,
            change=row.change,
            floor=row.floor,
            angle=row.angle,
            cost=cost,
            effect=effect,
            verdict=f"{effect} {_price(cost)}".strip(),
        )


def pareto(rows: Iterable[LevelRow]) -> list[LevelRow]:
    """The Pareto front of error and time, by increasing time."""
    measured = [row for row in rows if row.error is not None and row.seconds is not None]
    front: list[LevelRow] = []
    for row in sorted(measured, key=lambda row: (row.seconds or 0.0, row.error or 0.0)):
        if not front or (row.error or 0.0) < (front[-1].error or 0.0):
            front.append(row)
    return front


_NOTICEABLE = 0.1
"""Smallest relative change of the cost that counts."""


def _effect(row: LevelRow, home: LevelRow) -> str:
    if row.error is None or home.error is None or row.change is None:
        return "not known"
    least = row.floor or 0.0
    gain = home.error - row.error
    if row.change <= least:
        return "no difference"
    if abs(gain) <= least:
        return "other"
    return "better" if gain > 0 else "worse"


def _price(cost: float | None) -> str:
    if cost is None:
        return ""
    return "at no cost" if abs(cost - 1.0) <= _NOTICEABLE else "for more" if cost > 1.0 else "for less"


def _ratio(upper: float | None, lower: float | None) -> float | None:
    return None if upper is None or not lower else upper / lower
