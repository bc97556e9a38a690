"""Where runs are done, as `run --on` names it: here, as jobs of Slurm, or on a cluster of Ray."""

from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING

from zoobench.errors import UsageError
from zoobench.spec import Ref

if TYPE_CHECKING:
    from zoobench.harness.worker import WorkerOrders
    from zoobench.harness.worker_pool import WorkerPool

_LIBRARIES = {"slurm": "submitit", "ray": "ray"}
"""The engines by the names of their extras, with the library of each."""


def engine_named(text: str) -> "Callable[[WorkerOrders], WorkerPool] | None":
    """What makes the worker pool; None for that of this machine, which is named by an empty text or `here`.

    Others are `slurm`, `slurm[partition=cpu,time=120]` with options of sbatch, `ray`, and `ray=ADDRESS`.

    Raises:
        UsageError: another name, or the extra is not installed.
    """
    name, _, address = text.partition("=") if text.startswith("ray=") else (text, "", "")
    if name in ("", "here"):
        return None
    ref = Ref.parse(name)
    if ref.name not in _LIBRARIES or (ref.name == "ray" and ref.params):
        raise UsageError(f"Cannot run on {text!r}. Write here, slurm, 'slurm[partition=cpu]', ray or ray=ADDRESS.")
    library = _LIBRARIES[ref.name]
    if find_spec(library) is None:
        advice = f"Run: pip install 'zoobench[{ref.name}]'."
        raise UsageError(f"--on {ref.name} needs {library}, which is not installed. {advice}")
    if ref.name == "ray":
        from zoobench.harness.ray_pool import RayPool

        return partial(RayPool, address=address)
    from zoobench.harness.slurm_pool import SlurmPool, SlurmSettings

    return partial(SlurmPool, settings=SlurmSettings({key: _option(key, value) for key, value in ref.params}))


def _option(key: str, value: object) -> str | int:
    if isinstance(value, bool | float) or (key == "time" and not (isinstance(value, int) and value > 0)):
        raise UsageError(
            f"Cannot read {value!r} as {key} of Slurm. Options are words and whole numbers; time, minutes."
        )
    return value if isinstance(value, int) else str(value)
