"""`zoobench watch`: a robot in a window, moved by keys."""

from typing import Annotated

from typer import Argument, Option

from zoobench.cli import completion
from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    OneDesignOption,
    OneFidelityOption,
    component_option,
)
from zoobench.cli.output import say
from zoobench.cli.solutions import solution_named
from zoobench.errors import extra
from zoobench.spec import FRAME_SECONDS


def watch(
    run: Annotated[
        str,
        Argument(help="A run that is done, or best:ENV/TASK/DESIGN: its body.", autocompletion=completion.solutions),
    ] = "",
    env: Annotated[str, component_option("envs", "--env", "The environment; the run's, or ground.")] = "",
    task: Annotated[str, component_option("tasks", "--task", "The task; the run's, or movement-speed.")] = "",
    design: OneDesignOption = "caterpillar",
    fidelity: OneFidelityOption = "draft",
    every: Annotated[int, Option("--every", min=1, help="Show every n-th control frame.")] = 2,
    frames: Annotated[int, Option("--frames", min=1, help="Length of an episode in control frames.")] = 1000,
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Move a robot in a window with the keys.

    To see whether its body can be controlled. Each muscle has two keys, which the window names: one contracts it, one
    extends it. Enter begins again, Esc leaves. Time passes more slowly than in reality; a control frame is 8 ms. Needs
    the extra `watch`.
    """
    from zoobench import registry

    with extra("watch", "A window needs"):
        from zoobench.gym.keyboard import play
        from zoobench.gym.worlds import problem_of
    from zoobench.inputs import run_name
    from zoobench.registry import Kind

    body = design
    if run:
        found = solution_named(run, db).spec
        env, task, body = env or str(found.env), task or str(found.task), str(found.design)
        if "space" in registry.get(Kind.DESIGN, found.design.name).tags:
            body = f"stored[run={run_name(found.key())}]"
            fidelity = str(found.fidelity)  # the parameters of a body depend on it
    problem = problem_of(env or "ground", body, task or "movement-speed", fidelity, frames, worlds=1)
    shown = play(problem, every, say)
    say(f"{shown:,} control frames, {shown * FRAME_SECONDS:.1f} s of the robot's time")
