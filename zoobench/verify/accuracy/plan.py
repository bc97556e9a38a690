"""Runs of the accuracy study: a ladder of levels, one-factor variations of one of them, and the noise floor.

All are runs of the method `probe`, which evaluates the same controllers in each of them; they are queued, resumed and
stored like other runs.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain, product

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

LADDER = ("draft", "standard", "paper", "fine", "reference")
"""The levels, from coarse to fine; a finer grid has proportionally shorter steps."""

KNOBS = (
    "courant=0.9", "courant=0.25", "courant=0.1", "particles_per_cell=1", "particles_per_cell=4",
    "particles_per_cell=27", "kernel=cubic", "transfer=pic", "transfer=aflip", "precision=64",
)  # fmt: skip
"""Parameters of the fidelity that differ from those of a level, each of them alone."""

WATER = {"ocean", "shallow-water"}
BULK_FACTORS = (0.25, 4.0)
"""Factors of the water's bulk modulus: half and twice the speed of sound, twice and half the Mach number."""

SHIFTS = tuple(number / 8 for number in range(1, 8))
"""Displacements of the robot's start [cells]; the physics is the same, so that differences are noise."""

NUDGE = 1e-6
"""A displacement [cells] without effect unless the motion is chaotic."""

STRONG = Ref("sine-basis", params=(("scale", 1.0),))
"""Random controllers that use most of the muscles' range, so that their scores differ."""


@dataclass(frozen=True)
class StudyPlan:
    """Settings of the study.

    Attributes:
        levels: names out of `LADDER`, from coarse to fine.
        around: the level at which knobs are turned and noise is measured; "" for none.
        draws: number of controllers scored at every level, in the order of `levels`.
        knob_draws: number of controllers scored with a knob turned or a shift.
        close: number of controllers whose trajectory, shape and gradient are recorded, over `close_frames`.
        frames, close_frames: lengths of an episode in control frames.
    """

    levels: tuple[str, ...]
    around: str
    draws: tuple[int, ...]
    knob_draws: int = 4
    close: int = 2
    frames: int = 100
    close_frames: int = 50
    knobs: tuple[str, ...] = KNOBS
    shifts: tuple[float, ...] = (*SHIFTS, NUDGE)

    def __post_init__(self) -> None:
        unknown = [name for name in (*self.levels, *filter(None, (self.around,))) if name not in LADDER]
        if unknown or not self.levels:
            raise UsageError(f"Unknown levels: {', '.join(unknown) or 'none given'}. Choose from {', '.join(LADDER)}.")
        if len(self.draws) != len(self.levels):
            raise UsageError(f"{len(self.draws)} numbers of draws do not fit {len(self.levels)} levels. Give one each.")
        if min(*self.draws, self.knob_draws, self.frames, self.close_frames) < 1 or self.close < 0:
            raise UsageError("Numbers of draws and frames must be at least 1.")


QUICK = StudyPlan(levels=("draft", "standard"), around="", draws=(3, 3), close=1, frames=10, close_frames=5)
"""Two levels and short episodes: a check that everything works, in seconds per environment."""


def specs(envs: Sequence[Ref], tasks: Sequence[Ref], plan: StudyPlan) -> list[RunSpec]:
    """All runs of the study, the cheap ones first.

    Gradients are those of the first task; the others score the same motions.

    Raises:
        UnknownNameError, UsageError: a name or parameter that cannot be used.
    """
    if not envs or not tasks:
        raise UsageError("The study needs an environment and a task. Name at least one of each.")
    levels = product(zip(plan.draws, plan.levels, strict=True), envs)
    pairs = [_pair(env, tasks, Ref(fidelity), draws, plan) for (draws, fidelity), env in levels]
    if plan.around:
        pairs += [_around(env, tasks, plan) for env in envs]
    return list({spec.key(): spec for spec in chain.from_iterable(pairs)}.values())


def _around(env: Ref, tasks: Sequence[Ref], plan: StudyPlan) -> Iterable[RunSpec]:
    """The runs of one environment with a knob turned or a shift."""
    for knob in plan.knobs:
        yield from _pair(env, tasks, Ref.parse(f"{plan.around}[{knob}]"), plan.knob_draws, plan)
    for factor in BULK_FACTORS if env.name in WATER else ():
        usual = registry.resolve(Kind.ENV, env)
        changed = {**usual.kwargs, "bulk_modulus": factor * float(usual.kwargs["bulk_modulus"])}
        other = Ref(usual.name, usual.version, tuple(sorted(changed.items())))
        yield from _pair(other, tasks, Ref(plan.around), plan.knob_draws, plan)
    for shift in plan.shifts:
        yield from _pair(env, tasks, Ref(plan.around, params=(("shift", shift),)), plan.knob_draws, plan)


def _pair(env: Ref, tasks: Sequence[Ref], fidelity: Ref, draws: int, plan: StudyPlan) -> Iterable[RunSpec]:
    """The run that scores many controllers, and the shorter one that records trajectories and gradients of a few."""
    yield _spec(env, tasks, fidelity, draws, 0, plan.frames)
    if plan.close:
        yield _spec(env, tasks[:1], fidelity, plan.close, plan.close, plan.close_frames)


def _spec(env: Ref, tasks: Sequence[Ref], fidelity: Ref, draws: int, gradients: int, frames: int) -> RunSpec:
    also = "+".join(task.name for task in tasks[1:])
    probe = Ref("probe", params=(("also", also), ("gradients", gradients)))
    return RunSpec(
        env=registry.resolve(Kind.ENV, env),
        task=registry.resolve(Kind.TASK, tasks[0]),
        design=registry.resolve(Kind.DESIGN, Ref("caterpillar")),
        controller=registry.resolve(Kind.CONTROLLER, STRONG),
        method=registry.resolve(Kind.METHOD, probe),
        seed=0,
        budget=Budget("episodes", draws),
        fidelity=registry.resolve(Kind.FIDELITY, fidelity),
        frames=frames,
    )
