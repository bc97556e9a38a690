"""`zoobench watch`: a robot in the browser, moved by hand or by a trained gait."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from zoobench.cli import completion
from zoobench.cli.options import DEFAULT_DATABASE, DatabaseOption, component_option
from zoobench.cli.output import say
from zoobench.cli.solutions import solution_so_far
from zoobench.spec import FRAME_SECONDS

if TYPE_CHECKING:
    from zoobench.render.watching import Watched

_FRAMES = 1000  # of an episode of a robot that is moved by hand


def watch(
    run: Annotated[
        str,
        Argument(
            help="A run, or best:ENV/TASK/DESIGN, whose gait is shown; the best so far of a run in progress.",
            autocompletion=completion.solutions,
        ),
    ] = "",
    env: Annotated[str, component_option("envs", "--env", "Environment. Default: the run's, or ground.")] = "",
    task: Annotated[str, component_option("tasks", "--task", "Task. Default: the run's, or movement-speed.")] = "",
    design: Annotated[str, component_option("designs", "--design", "Design. Default: the run's, or caterpillar.")] = "",
    fidelity: Annotated[
        str, component_option("fidelities", "--fidelity", "Resolution of the simulation. Default: the run's, or draft.")
    ] = "",
    frames: Annotated[
        int | None,
        Option("--frames", min=1, help=f"Episode length in control frames. Default: the run's, or {_FRAMES}."),
    ] = None,
    host: Annotated[
        str, Option("--host", help="Address to serve on; 0.0.0.0 for everybody in your network.")
    ] = "127.0.0.1",
    port: Annotated[
        int | None,
        Option(
            "--port",
            min=0,
            max=65535,
            help="Port to serve on; 0 for any free one.",
            show_default="the first free one from 8080 on",
        ),
    ] = None,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Watch a robot in the browser and control it.

    The command prints the address of a page that shows the live simulation. The page has a slider for each muscle, and
    controls for pause, speed and restart. Keys contract and extend muscles. The robot of a run follows its trained gait
    until you take over. Ctrl-C stops the server. Everybody who can reach the address can control the robot. Needs the
    extra `watch`.
    """
    from zoobench.harness.interruption import Interruption
    from zoobench.render.viewer import Viewer, check_viewing
    from zoobench.render.watching import watch

    check_viewing()
    newest = _newest(run, db, (env, task, design, fidelity), frames)
    viewer = Viewer(host, port)
    try:
        with Interruption() as interruption:
            shown = watch(viewer, newest, say, interruption.check)
    finally:
        viewer.close()
    say(f"{shown:,} control frames, {shown * FRAME_SECONDS:.1f} s of the robot's time")


def _newest(run: str, db: str, chosen: tuple[str, str, str, str], frames: int | None) -> "Callable[[], Watched | None]":
    """Gives the solution to watch, which may become better; None where a run has found nothing yet.

    Args:
        chosen: environment, task, design and fidelity as they were given, empty for those of the run.
        frames: None for those of the run.
    """
    from zoobench.cell.firm_ground import usual_task
    from zoobench.cell.free_cell import free_cell, with_gait
    from zoobench.inputs import Start
    from zoobench.render.watching import Watched
    from zoobench.spec import Ref

    if not run:
        design = chosen[2] or "caterpillar"
        usual = ("ground", usual_task(Ref.parse(design)), design, "draft")
        env, task, design, fidelity = (given or default for given, default in zip(chosen, usual, strict=True))
        cell = free_cell(env, task, design, fidelity, frames or _FRAMES)
        by_hand = Watched(cell, f"{cell.design.name} in {cell.env.name}: {cell.task.name}")
        return lambda: by_hand

    settled: Watched | None = None

    def newest() -> Watched | None:
        nonlocal settled
        found = None if settled else solution_so_far(run, db)
        if found is None:
            return settled
        spec = found.spec
        axes = (spec.env, spec.task, spec.design, spec.fidelity)
        env, task, design, fidelity = (given or str(own) for given, own in zip(chosen, axes, strict=True))
        cell = with_gait(free_cell(env, task, design, fidelity, frames or spec.frames), Start(spec, found.params))
        where = f"{cell.env.name}: {cell.task.name}"
        words = f"{spec.design.name} in {where}, {found.name}, {spec.method.name}, {found.text(found.score)}"
        watched = Watched(cell, words)
        settled = watched if found.run is None or found.run.has_ended else None
        return watched

    return newest
