"""A submission: the run that evaluates an agent that was trained elsewhere."""

import sys
from importlib.util import find_spec
from pathlib import Path

from zoobench.errors import UsageError
from zoobench.harness.request import RunRequest
from zoobench.methods.external import EPISODES
from zoobench.spec import RunSelection


def submission(
    env: str, task: str, design: str, fidelity: str, frames: int, policy: str, settings: dict[str, str]
) -> RunRequest:
    """The request for the run of an agent in a cell.

    Args:
        env, task, design, fidelity: as on the command line.
        frames: length of the episode.
        policy: `module:function` or `file.py:function`.
        settings: of the method `external`, by name; empty ones are left out.

    Raises:
        UsageError: the policy cannot be found.
    """
    file, function = _found(policy)
    given = {"policy": file, "function": function, **{key: value for key, value in settings.items() if value}}
    method = f"external[{','.join(f'{key}={value}' for key, value in given.items())}]"
    chosen = RunSelection(env, task, design, f"trajectory[frames={frames}]", method, fidelity)
    return RunRequest(chosen, seeds="1", budget=f"{EPISODES} episodes", frames=frames)


def _found(policy: str) -> tuple[str, str]:
    """File and function of a policy; the file relative to the present folder where it lies below it."""
    module, _, function = policy.rpartition(":")
    if not module or not function.isidentifier():
        raise UsageError(f"Cannot read {policy!r} as a policy. Write module:function or file.py:function.")
    path = Path(module) if module.endswith(".py") else _file_of(module)
    if not path.is_file():
        raise UsageError(f"The policy's file {str(path)!r} is not there. Check the name.")
    here = Path.cwd()
    path = path.resolve()
    return str(path.relative_to(here) if path.is_relative_to(here) else path), function


def _file_of(module: str) -> Path:
    """The file of a module, which is looked for in the present folder, too; it is not imported."""
    sys.path.insert(0, str(Path.cwd()))
    try:
        spec = find_spec(module)
    except ImportError:
        spec = None
    finally:
        sys.path.pop(0)
    if spec is None or spec.origin is None:
        raise UsageError(f"There is no module {module!r} here. Give its file instead, as in agent.py:act.")
    return Path(spec.origin)
