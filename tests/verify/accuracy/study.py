"""Measurements made up from known laws, so that the analysis can be judged."""

from collections.abc import Sequence

from zoobench import registry
from zoobench.registry import Kind
from zoobench.spec import Ref
from zoobench_verify.accuracy.plan import other_transfer
from zoobench_verify.accuracy.records import Balance, Measurements, Numbers, Sample

TASK = "movement-speed"
LEVELS = ("draft", "standard", "paper")
TWIN = f"paper[transfer={other_transfer('paper')}]"
LIMITS = {
    f"{training}@{stage}": 0.01 * 1.2**number
    for number, (stage, training) in enumerate((stage, training) for stage in range(4) for training in "abcd")
}
"""Scores of sixteen gaits of four trainings at the finest grid, each a fifth better than the one before."""


def resolved(kind: Kind, text: str) -> Ref:
    """A resolved reference."""
    return registry.resolve(kind, Ref.parse(text))


def sample(
    fidelity: str,
    scores: Numbers,
    *,
    env: str = "ground",
    design: str = "caterpillar",
    found: str = "draft",
    slopes: dict[str, list[float]] | None = None,
) -> Sample:
    """A run that evaluated gaits for a simulated second: 2 s each, 6 s with gradient."""
    times = dict.fromkeys(scores, 2.0)
    refs = (resolved(Kind.ENV, env), resolved(Kind.TASK, TASK), resolved(Kind.DESIGN, design))
    return Sample(*refs, resolved(Kind.FIDELITY, fidelity), found, 125, scores, slopes or {}, times,
                  {gait: 3 * seconds for gait, seconds in times.items()}, 1000.0, 500, 2**20)  # fmt: skip


def scaled(factor: float, scores: Numbers = LIMITS) -> Numbers:
    """All scores times a factor."""
    return {gait: factor * score for gait, score in scores.items()}


def ladder(draft: Numbers | None = None, others: Sequence[Sample] = ()) -> Measurements:
    """Three levels: scores are half as large at draft (or as given) and 10 % too large at standard.

    At paper two transfers lie 5 % above and below the limits.
    """
    found = [scaled(0.5) if draft is None else draft, scaled(1.1), scaled(1.05)]
    levels = [sample(name, scores) for name, scores in zip(LEVELS, found, strict=True)]
    return Measurements((*levels, sample(TWIN, scaled(0.95)), *others), ("made up",))


def other_body(factors: Sequence[float], draft: float) -> list[Sample]:
    """The same gaits of a panda that is faster, by these factors at standard and by two transfers at paper, and at
    draft by that."""
    found = zip((*LEVELS, TWIN), (draft, *factors), strict=True)
    return [sample(name, scaled(factor), design="panda") for name, factor in found]


def balance(text: str, contact: float, env: str = "ground") -> Balance:
    """Muscles put in 2 J and take half a joule back; 0.4 J are stored, 0.6 lost to viscosity."""
    return Balance(resolved(Kind.ENV, env), resolved(Kind.FIDELITY, text), 2.0, 1.5, 0.4, 0.6, 0.0, contact)
