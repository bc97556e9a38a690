"""A request for runs as it is typed, and the runs of the grid or suite that it stands for."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Protocol

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.harness import presets, suites
from zoobench.harness.grid import MOST_SEEDS, GridSpec, Skip, expand, parse_selector
from zoobench.harness.imported import body_notes
from zoobench.harness.narrowing import narrowed
from zoobench.harness.starts import gait_notes, is_warm, look_in, names_runs, pinned, published_notes, start_notes
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSelection, RunSpec


class Chosen(Protocol):
    """A fidelity with the reason for it."""

    @property
    def fidelity(self) -> Ref:
        """The fidelity."""

    @property
    def reason(self) -> str:
        """Why it is the one."""


Choose = Callable[[Ref, Ref, float | None, float | None, Sequence[Ref]], Chosen]


@dataclass(frozen=True)
class RunRequest:
    """A request for runs; None, or an empty text, leaves the choice to the preset, or takes all that the suite has.

    An empty text of seeds or of a budget is none of either.
    """

    selection: RunSelection
    seeds: str | None = None
    suite: str = ""
    preset: str = ""
    smoke: bool = False
    budget: str | None = None
    frames: int | None = None
    tolerance: float | None = None
    decide: float | None = None
    device: str = ""

    @property
    def workers(self) -> int:
        """How many runs are done at a time where it is not said: a smoke run takes less than a process to begin."""
        return 1 if self.smoke or self.preset == "smoke" else 2

    def cells(self, location: str, choose: Choose, say: Callable[[str], None]) -> list[RunSpec | Skip]:
        """All runs that are asked for; with a tolerance, each environment and task at a fidelity of its own.

        Args:
            location: the database with the runs that others start from; it is opened only if there are such runs.
            choose: gives the fidelity for an environment and a task by tolerance, ratio to be decided, and designs.
            say: called with each choice of a fidelity, each use of a start, what was made of a file and each plug-in
                that does not load, as a line of text.

        Raises:
            UsageError: as `grid` or `narrowed`, there is no such start, no fidelity is good enough, or a file makes no
                body.
            StorageError: the database cannot be read.
        """
        for broken in registry.failures():
            say(f"The plug-in {broken.entry_point} of {broken.group} is left out, as it does not load: {broken.reason}")
        look_in(location)
        cells = self._part_of_suite() if self.suite else self._cells_of_grid(location, choose, say)
        if warm := [cell for cell in cells if isinstance(cell, RunSpec) and is_warm(cell)]:
            for note in start_notes(warm, location):
                say(note)
        specs = [cell for cell in cells if isinstance(cell, RunSpec)]
        for note in (*published_notes(specs), *gait_notes(specs), *body_notes(specs)):
            say(note)
        return cells

    def grid(self) -> GridSpec:
        """The grid that is asked for, its starts as they were typed.

        Raises:
            UsageError: something cannot be read; UnknownNameError: something is not known.
        """
        chosen = self.selection
        if missing := [f"--{name}" for name in ("env", "task") if not getattr(chosen, name)]:
            raise UsageError(
                f"Nothing is chosen by {' and '.join(missing)}. "
                "Name some, as in --env desert --task turning, or a whole benchmark, as in --suite gaits."
            )
        if self.smoke and self.preset not in ("", "smoke"):
            raise UsageError(f"--smoke is a preset, and --preset {self.preset} was given too. Leave one out.")

        def refs(text: str, kind: Kind) -> list[Ref] | None:
            return parse_selector(text, kind) if text else None

        return presets.get("smoke" if self.smoke else self.preset or presets.DEFAULT).grid(
            parse_selector(chosen.env, Kind.ENV),
            parse_selector(chosen.task, Kind.TASK),
            designs=refs(chosen.design, Kind.DESIGN),
            controllers=refs(chosen.controller, Kind.CONTROLLER),
            methods=refs(chosen.method, Kind.METHOD),
            seeds=self._seeds(),
            budget=self._budget(),
            fidelity=Ref.parse(chosen.fidelity) if chosen.fidelity else None,
            frames=self.frames,
        )

    def _cells_of_grid(self, location: str, choose: Choose, say: Callable[[str], None]) -> list[RunSpec | Skip]:
        grid = self.grid()
        axes = ((Kind.DESIGN, grid.designs), (Kind.CONTROLLER, grid.controllers), (Kind.METHOD, grid.methods))
        if any(names_runs(kind, refs) for kind, refs in axes):
            designs, controllers, methods = (tuple(pinned(kind, ref, location) for ref in refs) for kind, refs in axes)
            grid = replace(grid, designs=designs, controllers=controllers, methods=methods)
        if self.tolerance is None and self.decide is None:
            return self._expanded(grid)
        if self.selection.fidelity or self.smoke:
            raise UsageError("--tolerance and --decide choose the fidelity, and one was given too. Leave one out.")
        found = []
        for env, task in product(grid.envs, grid.tasks):
            choice = choose(env, task, self.tolerance, self.decide, grid.designs)
            say(choice.reason)
            found += self._expanded(replace(grid, envs=(env,), tasks=(task,), fidelity=choice.fidelity))
        return found

    def _expanded(self, grid: GridSpec) -> list[RunSpec | Skip]:
        """The runs of a grid on the device that is asked for."""
        if self.device:
            fidelity = grid.fidelity
            on_device = {**fidelity.kwargs, "device": self.device}
            grid = replace(grid, fidelity=replace(fidelity, params=tuple(sorted(on_device.items()))))
        return expand(grid)

    def _part_of_suite(self) -> list[RunSpec | Skip]:
        settings = {
            "--preset": self.preset, "--smoke": self.smoke, "--tolerance": self.tolerance is not None,
            "--decide": self.decide is not None, "--device": self.device,
        }  # fmt: skip
        if given := [name for name, is_given in settings.items() if is_given]:
            raise UsageError(f"A suite states every setting. Leave {' and '.join(given)} out, or --suite.")
        suite = suites.load(self.suite)
        return narrowed(suite, self.selection, seeds=self._seeds(), budget=self._budget(), frames=self.frames)

    def _seeds(self) -> tuple[int, ...] | None:
        return None if self.seeds is None else parse_seeds(self.seeds)

    def _budget(self) -> Budget | None:
        return None if self.budget is None else Budget.parse(self.budget)


def parse_seeds(text: str) -> tuple[int, ...]:
    """Read `3` as the seeds 0, 1, 2, and `0,4,7` (or `4,` for one) as those seeds.

    Raises:
        UsageError: no whole numbers, a negative one, no seed at all, or more than `MOST_SEEDS`.
    """
    words = [word.strip() for word in text.split(",")]
    try:
        numbers = [int(word) for word in words if word]
    except ValueError:
        raise UsageError(f"Cannot read {text!r} as seeds. Write how many (3), or which (0,1,2).") from None
    if any(number < 0 for number in numbers):
        raise UsageError(f"The seeds {text!r} hold a negative number. Give whole numbers from 0 upwards.")
    if len(words) == 1 and numbers and numbers[0] > MOST_SEEDS:
        raise UsageError(
            f"{text!r} means {numbers[0]:,} seeds, and {MOST_SEEDS:,} are the most. Write '{text},' for that one seed."
        )
    if len(words) == 1:
        numbers = list(range(numbers[0])) if numbers else []
    if not numbers:
        raise UsageError(
            f"{text!r} means no seed at all. Write how many, as in 1 for seed 0 alone, or which, with a comma as in 7, "
            "for seed 7."
        )
    return tuple(dict.fromkeys(numbers))
