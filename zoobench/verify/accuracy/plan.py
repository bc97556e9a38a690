"""Which runs the accuracy study consists of: a ladder of levels, one-factor sweeps around one of them, the noise floor.

All are runs of the method `probe`, which looks at the same controllers in each of them; so they are queued, resumed and
kept like any other.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

LADDER = ("draft", "standard", "paper", "fine", "reference")
"""The levels, from coarse to fine; a finer grid has proportionally shorter steps."""

KNOBS = (
    "courant=0.9",
    "courant=0.25",
    "courant=0.1",
    "particles_per_cell=1",
    "particles_per_cell=4",
    "particles_per_cell=27",
    "kernel=cubic",
    "transfer=pic",
    "transfer=aflip",
    "precision=64",
)
"""Each is turned alone."""

WATER = {"ocean", "shallow-water"}
BULK_FACTORS = (0.25, 4.0)
"""By which the water's bulk modulus is changed: half and twice the speed of sound, twice and half the Mach number."""

SHIFTS = tuple(number / 8 for number in range(1, 8))
"""Where on the grid the robot starts, in cells: no change of the question, so what it changes is noise."""

NUDGE = 1e-6
"""A shift [cells] too small to matter unless the motion is chaotic."""

STRONG = Ref("sine-basis", params=(("scale", 1.0),))
"""Controllers that use most of the muscles' range, so that their scores differ."""


@dataclass(frozen=True)
class Plan:
    """What is to be measured.

    Attributes:
        levels: names out of `LADDER`, from coarse to fine.
        around: the level whose knobs are turned and whose noise is measured; "" to leave that out.
        draws: controllers that are scored at every level, in the order of `levels`.
        knob_draws: controllers scored in sweeps and shifts.
        close: controllers whose path, shape and gradient are recorded, over `close_frames`.
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
            raise UsageError(f"The levels {', '.join(unknown) or 'are none'}. Choose from {', '.join(LADDER)}.")
        if len(self.draws) != len(self.levels):
            raise UsageError(f"{len(self.draws)} numbers of draws do not fit {len(self.levels)} levels. Give one each.")
        if min(*self.draws, self.knob_draws, self.frames, self.close_frames) < 1 or self.close < 0:
            raise UsageError("Draws and frames are counted from 1. Give larger numbers.")


QUICK = Plan(levels=("draft", "standard"), around="", draws=(3, 3), close=1, frames=10, close_frames=5)
"""Two levels and seconds an environment: everything moves, the numbers are as short as the episodes."""


def specs(envs: Sequence[Ref], tasks: Sequence[Ref], plan: Plan) -> list[RunSpec]:
    """All runs of the study, the cheap ones first.

    The first task is the one whose gradient is taken; the others score the same motions.

    Raises:
        UnknownNameError, UsageError: a name or parameter that cannot be used.
    """
    if not envs or not tasks:
        raise UsageError("The study needs an environment and a task. Name at least one of each.")
    found: dict[str, RunSpec] = {}
    for draws, fidelity in zip(plan.draws, plan.levels, strict=True):
        for env in envs:
            _add(found, _pair(env, tasks, Ref(fidelity), draws, plan))
    if plan.around:
        for env in envs:
            _add(found, _around(env, tasks, plan))
    return list(found.values())


def _around(env: Ref, tasks: Sequence[Ref], plan: Plan) -> Iterable[RunSpec]:
    """The sweeps and shifts of one environment."""
    for knob in plan.knobs:
        yield from _pair(env, tasks, Ref.parse(f"{plan.around}[{knob}]"), plan.knob_draws, plan)
    for factor in BULK_FACTORS if env.name in WATER else ():
        usual = registry.resolve(Kind.ENV, env)
        changed = {**usual.kwargs, "bulk_modulus": factor * float(usual.kwargs["bulk_modulus"])}
        other = Ref(usual.name, usual.version, tuple(sorted(changed.items())))
        yield from _pair(other, tasks, Ref(plan.around), plan.knob_draws, plan)
    for shift in plan.shifts:
        yield from _pair(env, tasks, Ref(plan.around, params=(("shift", shift),)), plan.knob_draws, plan)


def _pair(env: Ref, tasks: Sequence[Ref], fidelity: Ref, draws: int, plan: Plan) -> Iterable[RunSpec]:
    """The run that scores many controllers, and the shorter one that looks at a few closely."""
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


def _add(found: dict[str, RunSpec], more: Iterable[RunSpec]) -> None:
    for spec in more:
        found.setdefault(spec.key(), spec)
