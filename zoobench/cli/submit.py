"""`zoobench submit`: evaluate an agent that was trained elsewhere."""

from typing import Annotated

from typer import Option

from zoobench.cli.options import (
    DEFAULT_DATABASE,
    DatabaseOption,
    OneDesignOption,
    OneFidelityOption,
    coarsest_fidelity,
    component_option,
)
from zoobench.cli.output import say
from zoobench.cli.run import carry_through, queue


def submit(
    policy: Annotated[str, Option("--policy", help="The agent: module:function or file.py:function.")],
    env: Annotated[str, component_option("envs", "--env", "The environment.")],
    task: Annotated[str, component_option("tasks", "--task", "The task.")],
    design: OneDesignOption = "caterpillar",
    fidelity: OneFidelityOption = "standard",
    frames: Annotated[int, Option("--frames", min=1, help="Episode length in control frames.")] = 200,
    action: Annotated[str, Option("--action", help="Action space of the agent: waves or muscles.")] = "waves",
    weights: Annotated[str, Option("--weights", help="File of the agent's weights, recorded in the provenance.")] = "",
    name: Annotated[str, Option("--name", help="Name of the agent in tables.")] = "",
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Evaluate an agent that was trained elsewhere.

    The function maps the observation of a control frame to the action, as in the Gymnasium environment. It controls the
    robot for one episode. The score is stored with its provenance and the muscle activation, which repeats the episode
    without the agent. Tables show the method as `external`.
    """
    from zoobench.harness.submission import submission

    settings = {"action": action, "weights": weights, "agent": name}
    asked = submission(env, task, design, fidelity, frames, policy, settings)
    carry_through(queue(asked.cells(db, coarsest_fidelity, say), db), db, jobs=1)
