"""The coarsest fidelity that is good enough, by the published results of the accuracy study."""

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product, takewhile

from zoobench import registry
from zoobench.accuracy.ladder import LADDER
from zoobench.accuracy.levels import KeptOrders, LevelRow, components, published
from zoobench.errors import UsageError
from zoobench.registry import Kind, short
from zoobench.spec import Ref


@dataclass(frozen=True)
class FidelityChoice:
    """A fidelity, and the reason for its choice, in lines."""

    fidelity: Ref
    reason: str


def choose(
    env: Ref, task: Ref, tolerance: float | None, decide: float | None, designs: Sequence[Ref] = ()
) -> FidelityChoice:
    """The coarsest level of this environment and task that is, with each finer one, as good as is asked for.

    The reason says where the reference's own error was not measured, which no figure then holds, and how to measure it.

    Args:
        env, task: with the parameters that differ from the defaults.
        tolerance: the largest error of trained gaits' scores, with the reference's own where it is known; None for any.
        decide: the ratio above which the order of two scores must hold; None for none. With several designs these are
            scores of two bodies.
        designs: to be compared; each with the error of all that were measured if it was not measured itself.

    Raises:
        UsageError: no level is, or this environment and task were not measured in their present version.
    """
    if tolerance is not None and not 0.0 < tolerance < math.inf:
        raise UsageError(f"A tolerance of {tolerance:g} cannot be met. Give a share of the score, as in 0.2.")
    if decide is not None and not 1.0 <= decide < math.inf:
        raise UsageError(f"A ratio of {decide:g} decides nothing. Give the larger score by the smaller, as in 1.5.")
    rows, place = _rows(env, task), short(Kind.ENV, env)
    names = {short(Kind.DESIGN, registry.resolve(Kind.DESIGN, design)) for design in designs}
    # a search in a design space compares bodies, too
    spaces = any("space" in registry.get(Kind.DESIGN, design.name).tags for design in designs)
    question = _Question(tolerance, decide, frozenset(names), len(names) > 1 or spaces)
    if decide is not None and not any(question.orders(row).pairs for row in rows):
        raise UsageError(
            f"No order of two bodies is known in {place} x {task.name}: gaits of {_bodies(rows[-1])} "
            "were compared with those of the same body alone. Choose one design of a fixed body, or the fidelity with "
            "--fidelity."
        )
    # a coarse level whose error is smaller than that of a finer one is so by chance
    good = list(takewhile(question.is_met, reversed(rows)))[::-1]
    if not good:
        best = min(rows, key=question.bound if decide is None else question.ratio)
        wanted = [f"within {tolerance:g}"] if tolerance is not None else []
        wanted += [f"sure of ratios above {decide:g}"] if decide is not None else []
        raise UsageError(
            f"No fidelity is known to be {' and '.join(wanted)} in {place} x {task.name}: the best is "
            f"{question.describe(best)}. Ask for less, or choose with --fidelity."
        )
    reason = [f"{place} x {task.name}: {question.describe(good[0])}"]
    reason += [f"  not {question.describe(row)}" for row in rows if row is not good[0]]
    if unmeasured := names - set(good[0].bodies):
        reason.append(f"  {', '.join(sorted(unmeasured))}: not measured there, and may be off by more")
    if good[0].unknown is None:
        reason.append(_missing_check(env, task))
    return FidelityChoice(Ref(good[0].fidelity), "\n".join(reason))


def _missing_check(env: Ref, task: Ref) -> str:
    """That the error of the finest level is in no figure, and the command that measures it."""
    names = [row.fidelity for row in _present(env, task)]
    text = f"  How far {names[-1]} itself is off was not measured for each of these animals and is in no figure"
    finer = LADDER[LADDER.index(names[-1]) + 1 :]
    if not finer:
        return text
    return (
        f"{text}. To measure it: zoobench verify accuracy run --env '{short(Kind.ENV, env)}' --task {task.name} "
        f"--levels {','.join(names)} --verify-at {finer[0]}"
    )


@dataclass(frozen=True)
class _Question:
    """The requirements on a level; see `choose`."""

    tolerance: float | None
    decide: float | None
    designs: frozenset[str]
    compares_bodies: bool

    def is_met(self, row: LevelRow) -> bool:
        """Whether a level is good enough."""
        return self.bound(row) <= (self.tolerance or math.inf) and self.ratio(row) <= (self.decide or math.inf)

    def bound(self, row: LevelRow) -> float:
        """The largest error of scores: that of the body with the largest error."""
        return max((row.bodies.get(design) or _bound(row) for design in self.designs), default=_bound(row))

    def ratio(self, row: LevelRow) -> float:
        """The ratio above which the order of two scores holds."""
        ratio = self.orders(row).ratio
        return math.inf if ratio is None else ratio

    def orders(self, row: LevelRow) -> KeptOrders:
        """The orders that are asked for."""
        return row.two_bodies if self.compares_bodies else row.one_body

    def describe(self, row: LevelRow) -> str:
        """A level's figures, and the bodies on which they rest."""
        by = f"{row.checked} on a finer grid" if row.checked else "two transfers on one grid alone"
        known = "error of the reference not measured"
        if row.unknown is not None:
            known = f"reference known to {row.unknown:.2g} by {by}"
        facts = [f"{row.gaits} gaits of {_bodies(row)}", known]
        orders = self.orders(row)
        pairs = f"{orders.pairs} pairs of {'two bodies' if orders == row.two_bodies else 'one body'}"
        ratio = "no ratio is known to keep" if orders.ratio is None else f"ratios above {orders.ratio:.3g} keep"
        facts += [f"{ratio} their order, by {pairs}: {', '.join(orders.bodies)}"] if orders.pairs else []
        facts += [] if row.seconds is None else [f"{row.seconds:.2g} s per simulated second"]
        least = " or more" if row.unknown is None else ""
        return f"{row.fidelity} with scores off by {self.bound(row):.2g}{least} ({', '.join(facts)})"


def orders(env: Ref, task: Ref, fidelity: Ref, of_two: bool) -> KeptOrders | None:
    """Which orders of one body hold there, or of two, of resolved components; None where none were compared."""
    row = _level(env, task, fidelity)
    found = None if row is None else row.two_bodies if of_two else row.one_body
    return found if found and found.pairs else None


def _level(env: Ref, task: Ref, fidelity: Ref) -> LevelRow | None:
    try:
        rows = _rows(env, task)
    except UsageError:  # not measured, or of a plug-in that is gone
        return None
    return next((row for row in rows if row.components == components(env, task, fidelity)), None)


def known_levels(envs: Iterable[Ref], tasks: Iterable[str]) -> tuple[LevelRow, ...]:
    """The published levels of these environments and tasks whose error is known, in their present versions, with the
    orders that each finer level keeps, too.

    Raises:
        UsageError: there are none.
    """
    found: list[LevelRow] = []
    for env, task in product(envs, tasks):
        with suppress(UsageError):  # not measured
            found += _rows(env, Ref(task))
    if not found:
        raise UsageError(
            "No accuracy of these environments and tasks is published. Measure it: zoobench verify accuracy run"
        )
    return tuple(found)


def error_at(env: Ref, task: Ref, fidelity: Ref) -> float | None:
    """The error of scores there, as a share of them; None where no study of it is published."""
    row = _level(env, task, fidelity)
    return None if row is None else _bound(row)


def _rows(env: Ref, task: Ref) -> list[LevelRow]:
    """The levels with a known error, from coarse to fine, measured with the present components.

    Their orders are those that each finer level keeps, too: what a finer one does not, a coarse one keeps by chance.
    """
    rows: list[LevelRow] = []
    for row in reversed(_present(env, task)):
        if row.error is not None:
            one = _kept_by_finer(row.one_body, [each.one_body for each in rows])
            two = _kept_by_finer(row.two_bodies, [each.two_bodies for each in rows])
            rows.insert(0, replace(row, one_body=one, two_bodies=two))
    if not rows:
        place = short(Kind.ENV, registry.resolve(Kind.ENV, env))
        raise UsageError(
            f"The accuracy of {place} x {task.name} in its present version was not measured. Measure it with "
            f"`zoobench verify accuracy run --env '{place}' --task {task.name}`, or choose with --fidelity."
        )
    return rows


def _kept_by_finer(own: KeptOrders, finer: Sequence[KeptOrders]) -> KeptOrders:
    """The orders that a level keeps and each finer one, too; none where one of them is not known to keep any."""
    ratio = max(each.ratio or math.inf for each in (own, *finer))
    return replace(own, ratio=ratio if ratio < math.inf else None)


def _present(env: Ref, task: Ref) -> list[LevelRow]:
    """The levels from coarse to fine, measured with the present components."""
    resolved = registry.resolve(Kind.ENV, env), registry.resolve(Kind.TASK, task)
    present = [components(*resolved, registry.resolve(Kind.FIDELITY, Ref(name))) for name in LADDER]
    return sorted((row for row in published().levels if row.components in present), key=lambda row: -row.spacing)


def _bound(row: LevelRow) -> float:
    """Error of a level's scores: their distance to the reference, and the reference's own where it was measured."""
    return math.inf if row.error is None else math.hypot(row.error, row.unknown or 0.0)


def _bodies(row: LevelRow) -> str:
    return ", ".join(sorted(row.bodies))
