"""From the words after `run` and `plan` to a grid, or to a part of a suite."""

from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

from zoobench.cli.output import say
from zoobench.errors import UsageError

MOST_SEEDS = 10_000

if TYPE_CHECKING:
    from zoobench.harness.grid import GridSpec, Skip
    from zoobench.spec import RunSpec


@dataclass(frozen=True)
class Selection:
    """What was typed; an empty text or None leaves the choice to the preset, or takes all that the suite has."""

    env: str = ""
    task: str = ""
    design: str = ""
    controller: str = ""
    method: str = ""
    seeds: str = ""
    preset: str = ""
    smoke: bool = False
    budget: str = ""
    frames: int | None = None
    fidelity: str = ""
    tolerance: float | None = None
    db: str = ""  # where the runs are that others start from
    suite: str = ""

    def cells(self) -> "list[RunSpec | Skip]":
        """All runs that were asked for; with a tolerance, each environment and task at a fidelity of its own.

        Raises:
            UsageError: as `grid` or `Narrowing.of`, or no fidelity is known to be within the tolerance.
        """
        from zoobench.harness.grid import expand

        if self.suite:
            return self._told(self._part_of_suite())
        grid = self.grid()
        if self.tolerance is None:
            return self._told(expand(grid))
        if self.fidelity or self.smoke:
            raise UsageError("--tolerance chooses the fidelity, and one was given too. Leave one of them out.")
        from zoobench.verify.accuracy.tolerance import choose

        found = []
        for env, task in product(grid.envs, grid.tasks):
            choice = choose(env, task.name, self.tolerance)
            say(choice.reason)
            found += expand(replace(grid, envs=(env,), tasks=(task,), fidelity=choice.fidelity))
        return self._told(found)

    def _told(self, cells: "list[RunSpec | Skip]") -> "list[RunSpec | Skip]":
        """The cells, after saying how those with a start begin."""
        from zoobench.cli.starts import tell_starts
        from zoobench.harness.grid import Skip

        tell_starts([cell for cell in cells if not isinstance(cell, Skip)], self.db)
        return cells

    def _part_of_suite(self) -> "list[RunSpec | Skip]":
        from zoobench.harness import suites
        from zoobench.harness.narrowing import Narrowing
        from zoobench.spec import Budget

        settings = {"--preset": self.preset, "--smoke": self.smoke, "--tolerance": self.tolerance is not None}
        if given := [name for name, is_given in settings.items() if is_given]:
            raise UsageError(f"A suite states every setting. Leave {' and '.join(given)} out, or --suite.")
        return Narrowing(
            self.env, self.task, self.design, self.controller, self.method, self.fidelity,
            seeds=parse_seeds(self.seeds) if self.seeds else None,
            budget=Budget.parse(self.budget) if self.budget else None,
            frames=self.frames,
        ).of(suites.load(self.suite))  # fmt: skip

    def grid(self) -> "GridSpec":
        """The grid that was asked for.

        Raises:
            UsageError: something cannot be read; UnknownNameError: something is not known.
        """
        from zoobench.cli.starts import pinned
        from zoobench.harness import presets
        from zoobench.harness.grid import parse_selector
        from zoobench.registry import Kind
        from zoobench.spec import Budget, Ref

        if missing := [name for name in ("env", "task") if not getattr(self, name)]:
            raise UsageError(
                f"Nothing is chosen by {' and '.join(f'--{name}' for name in missing)}. "
                "Name some, as in --env desert --task turning, or a whole benchmark, as in --suite laptop."
            )

        def chosen(text: str, kind: Kind) -> list[Ref] | None:
            return parse_selector(text, kind) if text else None

        return presets.get(self._preset_name()).grid(
            parse_selector(self.env, Kind.ENV),
            parse_selector(self.task, Kind.TASK),
            designs=chosen(self.design, Kind.DESIGN),
            controllers=chosen(self.controller, Kind.CONTROLLER),
            methods=pinned(parse_selector(self.method, Kind.METHOD), self.db) if self.method else None,
            seeds=parse_seeds(self.seeds) if self.seeds else None,
            budget=Budget.parse(self.budget) if self.budget else None,
            fidelity=Ref.parse(self.fidelity) if self.fidelity else None,
            frames=self.frames,
        )

    def _preset_name(self) -> str:
        from zoobench.harness import presets

        if self.smoke and self.preset not in ("", "smoke"):
            raise UsageError(f"--smoke is a preset, and --preset {self.preset} was given too. Leave one out.")
        return "smoke" if self.smoke else self.preset or presets.DEFAULT


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
        raise UsageError(f"{text!r} means no seed at all. Give at least 1.")
    return tuple(dict.fromkeys(numbers))
