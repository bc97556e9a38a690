"""Options that several commands share, each described once, and how their texts are read."""

import os
import re
import shlex
from collections.abc import Callable, Sequence
from inspect import Signature, signature
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, Option

from zoobench.cli import completion
from zoobench.cli.output import Format
from zoobench.errors import UsageError
from zoobench.spec import RunSelection

if TYPE_CHECKING:
    from zoobench.accuracy.tolerance import FidelityChoice
    from zoobench.harness.request import RunRequest
    from zoobench.spec import Ref

DEFAULT_DATABASE = "zoobench.db"
_UNITS = {"": 1.0, "s": 1.0, "min": 60.0, "m": 60.0, "h": 3600.0}


def _choose_database(location: str) -> str:
    """The location as it is; settings may name the runs there from now on.

    Raises:
        UsageError: it is empty, as a variable of a shell that is not set.
    """
    from zoobench.harness.starts import look_in

    if not location:
        raise UsageError(
            f"--db '' names no database. Give the path of a file, or leave --db out for {DEFAULT_DATABASE}."
        )
    return look_in(location)


DatabaseOption = Annotated[
    str,
    Option("--db", envvar="ZOOBENCH_DB", help="Database: a file, or a PostgreSQL URL.", callback=_choose_database),
]
FormatOption = Annotated[Format, Option("--format", "-f", help="Output format.")]
UnitOption = Annotated[str, Option("--unit", help="Unit of the scores, as in mm/s for m/s.")]


def _run_argument(text: str, offer: Any = completion.runs) -> Any:
    """An argument that names runs."""
    return Argument(help=text, autocompletion=offer)


_OR_BEST = "; or best:ENV/TASK/DESIGN, the best solution on a leaderboard, see `zoobench list solutions`."

RunsArgument = Annotated[list[str] | None, _run_argument("Runs: their numbers, or the starts of their keys.")]
DoneRunArgument = Annotated[
    str, _run_argument(f"A finished run: its number, or the start of its key{_OR_BEST}", completion.solutions)
]
DoneRunsArgument = Annotated[
    list[str] | None,
    _run_argument(f"Finished runs: their numbers, or the starts of their keys{_OR_BEST}", completion.solutions),
]


def component_option(kind: str, name: str, text: str) -> Any:
    """An option whose values are names of components."""
    return Option(name, help=text, autocompletion=completion.components(kind))


EnvOption = Annotated[str, component_option("envs", "--env", "Environments: names or globs, separated by commas.")]
TaskOption = Annotated[str, component_option("tasks", "--task", "Tasks: names or globs, separated by commas.")]
DesignOption = Annotated[str, component_option("designs", "--design", "Designs. Default: the preset's.")]
ControllerOption = Annotated[
    str, component_option("controllers", "--controller", "Controllers. Default: the preset's.")
]
MethodOption = Annotated[
    str,
    component_option("methods", "--method", "Methods, as in 'random,diffphysics[lr=0.05]'. Default: the preset's."),
]
SeedsOption = Annotated[str | None, Option("--seeds", help="Number of seeds (3), or the seeds themselves (0,1,2).")]
PresetOption = Annotated[
    str,
    Option(
        "--preset",
        help="Named set of defaults; see `zoobench list presets`.",
        show_default="quick",
        autocompletion=completion.presets,
    ),
]
SuiteOption = Annotated[
    str,
    Option(
        "--suite",
        help="Suite of runs: a name from `zoobench list suites`, or a .yaml file. Other options select a part of it.",
        autocompletion=completion.suites,
    ),
]
SmokeOption = Annotated[
    bool, Option("--smoke", help="Use the preset smoke, which takes seconds. Tables leave its runs out.")
]
BudgetOption = Annotated[
    str | None, Option("--budget", help="Budget per run, as in '200000 substeps' or '60 seconds'.")
]
FramesOption = Annotated[int | None, Option("--frames", help="Episode length in control frames.")]
FidelityOption = Annotated[
    str, component_option("fidelities", "--fidelity", "Resolution of the simulation, as in 'draft[precision=64]'.")
]
DeviceOption = Annotated[
    str,
    Option(
        "--device", help="Device of the simulation: cpu, or cuda for an NVIDIA GPU. Short for fidelity[device=cuda]."
    ),
]
ToleranceOption = Annotated[
    float | None,
    Option("--tolerance", help="Choose the coarsest fidelity whose relative score error is at most this, as 0.2."),
]
DecideOption = Annotated[
    float | None,
    Option(
        "--decide",
        help="Choose the coarsest fidelity that ranks scores as the finest does if their ratio exceeds this, as 1.5. "
        "With several designs, these are scores of two bodies.",
    ),
]
WorkersOption = Annotated[int, Option("--jobs", "-j", min=1, max=10_000, help="Runs in parallel; about one per core.")]
RunWorkersOption = Annotated[
    int | None,
    Option(
        "--jobs",
        "-j",
        min=1,
        max=10_000,
        help="Runs in parallel; about one per core.",
        show_default="2; 1 with --smoke",
    ),
]

TimeoutOption = Annotated[str | None, Option("--timeout", help="Time limit per attempt: 90s, 10min, 2h.")]
MemoryOption = Annotated[
    str,
    Option(
        "--memory",
        envvar="ZOOBENCH_MEMORY",
        help="Memory limit per run, as in 2GB. A run that exceeds it fails. By default a run stores states for "
        "gradients in a quarter of its share of the free memory. Less memory slows gradients and changes no result.",
    ),
]

OneDesignOption = Annotated[str, component_option("designs", "--design", "The design.")]
OneControllerOption = Annotated[str, component_option("controllers", "--controller", "The controller.")]
OneFidelityOption = Annotated[str, component_option("fidelities", "--fidelity", "Resolution of the simulation.")]


def selection(
    env: Annotated[
        str, component_option("envs", "--env", "Only these environments: names, globs, or name[key=value].")
    ] = "",
    task: Annotated[str, component_option("tasks", "--task", "Only these tasks.")] = "",
    design: Annotated[str, component_option("designs", "--design", "Only these designs.")] = "",
    controller: Annotated[str, component_option("controllers", "--controller", "Only these controllers.")] = "",
    method: Annotated[str, component_option("methods", "--method", "Only these methods.")] = "",
    fidelity: Annotated[str, component_option("fidelities", "--fidelity", "Only this fidelity.")] = "",
) -> RunSelection:
    """The stored runs that a command is about."""
    return RunSelection(env, task, design, controller, method, fidelity)


def request(
    env: EnvOption = "",
    task: TaskOption = "",
    design: DesignOption = "",
    controller: ControllerOption = "",
    method: MethodOption = "",
    seeds: SeedsOption = None,
    suite: SuiteOption = "",
    preset: PresetOption = "",
    smoke: SmokeOption = False,
    budget: BudgetOption = None,
    frames: FramesOption = None,
    fidelity: FidelityOption = "",
    tolerance: ToleranceOption = None,
    decide: DecideOption = None,
    device: DeviceOption = "",
) -> "RunRequest":
    """The runs that a command asks for."""
    from zoobench.harness.request import RunRequest

    chosen = RunSelection(env, task, design, controller, method, fidelity)
    return RunRequest(chosen, seeds, suite, preset, smoke, budget, frames, tolerance, decide, device)


def coarsest_fidelity(
    env: "Ref", task: "Ref", tolerance: float | None, decide: float | None, designs: "Sequence[Ref]"
) -> "FidelityChoice":
    """See `zoobench.accuracy.tolerance.choose`, whose results are loaded only if they are asked for."""
    from zoobench.accuracy.tolerance import choose

    return choose(env, task, tolerance, decide, designs)


def takes(*builds: Callable[..., Any]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options of these functions, whose results are the command's first arguments."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        groups = [(build, signature(build).parameters) for build in builds]
        own = [*signature(command).parameters.values()][len(builds) :]

        def run(**values: Any) -> None:
            built = [build(**{name: values.pop(name) for name in shared}) for build, shared in groups]
            command(*built, **values)

        run.__doc__, run.__name__ = command.__doc__, command.__name__
        shared_options = [option for _, shared in groups for option in shared.values()]
        run.__signature__ = Signature([*shared_options, *own])  # type: ignore[attr-defined]  # what Typer reads
        return run

    return decorate


def parse_names(text: str) -> list[str]:
    """Read `ice, desert` as names or globs."""
    return [name.strip() for name in text.split(",")]


def command_text(*words: str, db: str) -> str:
    """A command to type in the same place, with the database where it must be named, but no password."""
    from zoobench.db.engine import without_password

    is_known = db in (DEFAULT_DATABASE, os.environ.get("ZOOBENCH_DB"))
    return shlex.join(["zoobench", *words, *([] if is_known else ["--db", without_password(db)])])


def parse_duration(text: str) -> float:
    """Read `90`, `90s`, `10min` or `1.5h` as seconds.

    Raises:
        UsageError: another shape, or no time at all.
    """
    match = re.fullmatch(r"\s*([0-9]+(?:\.[0-9]+)?)\s*(s|min|m|h)?\s*", text)
    seconds = float(match[1]) * _UNITS[match[2] or ""] if match else 0.0
    if seconds <= 0:
        raise UsageError(f"Cannot read {text!r} as a time limit. Write for example 90s, 10min or 2h.")
    return seconds
