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
    policy: Annotated[str, Option("--policy", help="The agent, module:function or file.py:function.")],
    env: Annotated[str, component_option("envs", "--env", "The environment.")],
    task: Annotated[str, component_option("tasks", "--task", "The task.")],
    design: OneDesignOption = "caterpillar",
    fidelity: OneFidelityOption = "standard",
    frames: Annotated[int, Option("--frames", min=1, help="Length of the episode in control frames.")] = 200,
    action: Annotated[str, Option("--action", help="What the agent gives: waves or muscles.")] = "waves",
    weights: Annotated[str, Option("--weights", help="A file that the agent reads, to be part of the record.")] = "",
    name: Annotated[str, Option("--name", help="A name for tables.")] = "",
    db: DatabaseOption = DEFAULT_DATABASE,
) -> None:
    """Evaluate an agent that was trained elsewhere.

    The function takes the observation of a control frame and returns the action, as in the environment of Gymnasium. It
    acts for one episode under the meter. The score is stored with its provenance and with the muscles' activity, by
    which it can be repeated without the agent. Tables show it as `external`.
    """
    from zoobench.harness.submission import submission

    settings = {"action": action, "weights": weights, "agent": name}
    asked = submission(env, task, design, fidelity, frames, policy, settings)
    carry_through(queue(asked.cells(db, coarsest_fidelity, say), db), db, jobs=1)
