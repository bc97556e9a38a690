"""Runs, one after the other, in a process of their own: `python -m zoobench.harness.child`, started by a worker.

A line of standard input is a job, as JSON: `spec`, `checkpoint` (base64 or null), `stored` (`spec`, `params` and
`milestones` of every run that the spec names as start, gait or body) and `log_end`, a word. While the run goes on a
line `"stop"` asks the method to return. A line `{"reference": [value, unit]}` answers `reference_wanted`; with null as
value it is to be computed here. Messages go to standard output, one JSON object a line with a `type`:

* `metric`: `step`, `values`
* `milestone`: `step`, `score`, `params` (base64)
* `checkpoint`: `data` (base64)
* `progress`: `fraction`, `score`
* `reference_wanted`: `key` of a reference score; then `reference`: `key`, `value`, `unit`, if it was computed here
* one of `done` (`finals`, `params`, `archive` in base64 or null), `diverged` (`reason`), `failed` (`reason`,
  `traceback`) or `stopped`, as the last one of a run, with `peak_memory` [bytes].

Anything that other code prints goes to standard error, which is the run's log. After the last message of a run the
process ends, or it ends the log with a line of the word `log_end` and waits for the next job. It does so only after a
run that ended well and has left nothing behind by which the next could tell that it is not the first.
"""

import base64
import ctypes
import gc
import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from itertools import count
from typing import TYPE_CHECKING, Any, NamedTuple

from zoobench import registry
from zoobench.cell.loading import load_simulator
from zoobench.cell.memory import allowed, begin_account, memory_of, peak_memory
from zoobench.cell.seeding import METHOD_AXES, STUDY_AXES, generator
from zoobench.db.rows import encode_params
from zoobench.errors import DivergenceError, ZoobenchError
from zoobench.harness.finals import Final, finals_of
from zoobench.harness.lifeline import Lifeline, end_descendants, end_group, stay_guarded, take_standard_input
from zoobench.harness.provenance import plugins_of
from zoobench.harness.repetition import check_parameters, repeated
from zoobench.harness.traces import Surroundings
from zoobench.inputs import Start, find_with, named_run, run_name, solution_in
from zoobench.registry import Kind
from zoobench.spec import RunSpec, on_gpu

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from zoobench.methods.base import Method
    from zoobench.tasks.base import Metric

_EVERY_STEP = 99_999
"""Up to which a curve has all its points."""

_NO_STEP = 2**31
"""From which on a step is refused."""

_MOST_RUNS = 100
"""That one process does: a hundredth of a start for each is nothing, and nothing adds up for ever."""

_MOST_GROWTH = 2**29
"""Memory between two runs beyond that before the first [bytes]; the kernels of two environments take a fifth."""


class RunOutcome(NamedTuple):
    """The result of a run: final values, its solution, and in base64 the archive if its method keeps one."""

    finals: list[Final]
    params: list[float]
    archive: str | None = None


class StoppedError(Exception):
    """The worker has asked to stop: there is no result."""


class Wire:
    """The messages to the worker, on standard output; the output of all other code goes to standard error, the log."""

    def __init__(self) -> None:
        self._stream = os.fdopen(os.dup(1), "wb", buffering=0)
        os.dup2(2, 1)

    def send(self, kind: str, **contents: Any) -> None:
        """Send one message; numbers keep every bit."""
        line = memoryview(json.dumps({"type": kind, **contents}).encode() + b"\n")
        while line:
            line = line[self._stream.write(line) :]

    def end_log(self, word: str) -> None:
        """Say that a run has printed all that it will."""
        sys.stdout.flush()
        sys.stderr.flush()
        if sys.platform != "win32":
            ctypes.CDLL(None).fflush(None)  # what libraries have printed
        os.write(2, f"\n{word}\n".encode())


class Orders:
    """What the worker says.

    Attributes:
        stop: whether the run in hand is to stop.
    """

    def __init__(self) -> None:
        self.stop = threading.Event()
        self._jobs: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()
        self._answers: queue.SimpleQueue[tuple[float | None, str]] = queue.SimpleQueue()
        self._has_run = False

    def hear(self, line: bytes) -> None:
        """Take in a line."""
        said = json.loads(line)
        if said == "stop":
            self.stop.set()
            self._answers.put((None, ""))  # nobody is to wait any longer
        elif "reference" in said:
            self._answers.put(tuple(said["reference"]))
        else:
            self._has_run = True
            self.stop.clear()
            self._answers = queue.SimpleQueue()
            self._jobs.put(said)

    def end(self) -> None:
        """The worker says no more: in the midst of a run it has died, and so does this process."""
        if self._has_run:
            end_group()
        self._jobs.put(None)

    def finish_run(self) -> None:
        """The end of the worker is none of a run from now on."""
        self._has_run = False

    def job(self) -> dict[str, Any] | None:
        """The next job, as soon as there is one; None if there will be none."""
        return self._jobs.get()

    def answer(self) -> tuple[float | None, str]:
        """Value and unit of the reference score that was asked for, as soon as it is told.

        Raises:
            StoppedError: the run is to stop.
        """
        answer = self._answers.get()
        if self.stop.is_set():
            raise StoppedError
        return answer


class ChildContext:
    """The `RunContext` of a method that runs in a child process, and the `SharedScores` of its run.

    Attributes:
        parameter_count: length of a solution; None while it is not known.
    """

    def __init__(self, spec: RunSpec, wire: Wire, checkpoint: bytes | None, orders: Orders) -> None:
        self.rng = generator(spec, "method", STUDY_AXES if _is_study(spec) else METHOD_AXES)
        self._wire = wire
        self._checkpoint = checkpoint
        self._orders = orders
        self._kept = b""
        self.parameter_count: int | None = None

    def report(self, step: int, **metrics: float) -> None:
        """Put a point on the learning curve; beyond 100,000 steps every tenth, beyond a million every hundredth.

        So it is whenever a run is resumed: which points there are depends on their steps alone.
        """
        if _EVERY_STEP < step < _NO_STEP and step % 10 ** (len(str(step)) - len(str(_EVERY_STEP))):
            return
        self._wire.send("metric", step=step, values={name: float(value) for name, value in metrics.items()})

    def milestone(self, step: int, score: float, params: "NDArray[np.float64]") -> None:
        """Keep the best parameters after so many iterations, unless they are those that were kept last.

        Raises:
            UsageError: they are not as many as the problem has, or not finite.
        """
        if self.parameter_count is not None:
            check_parameters(params, self.parameter_count)
        data = encode_params(params.tolist())
        if data != self._kept:
            self._wire.send("milestone", step=step, score=score, params=base64.b64encode(data).decode())
        self._kept = data

    def checkpoint(self, data: bytes) -> None:
        """Replace the stored state; everything reported before becomes durable with it."""
        self._wire.send("checkpoint", data=base64.b64encode(data).decode())

    def restore(self) -> bytes | None:
        """The state that an earlier attempt stored last, or None."""
        return self._checkpoint

    def should_stop(self) -> bool:
        """Whether the worker has asked to stop."""
        return self._orders.stop.is_set()

    def reference(self, key: str) -> "Metric | None":
        """A reference score that another run has computed, waited for if one is at it; None if this one is to do it.

        Raises:
            StoppedError: the run is to stop.
        """
        from zoobench.tasks.base import Metric

        self._wire.send("reference_wanted", key=key)
        value, unit = self._orders.answer()
        return None if value is None else Metric(value, unit)

    def keep_reference(self, key: str, score: "Metric") -> None:
        """Let other runs have a reference score."""
        self._wire.send("reference", key=key, value=score.value, unit=score.unit)

    def progress(self, fraction: float, score: float | None) -> None:
        """Report the fraction of the run that is done, in [0, 1], and the score of the incumbent."""
        self._wire.send("progress", fraction=float(fraction), score=None if score is None else float(score))


def _is_study(spec: RunSpec) -> bool:
    """Whether the run measures the simulator and is compared with no other."""
    return registry.FOR_STUDIES in registry.get(Kind.METHOD, spec.method.name, spec.method.version).tags


def solve(spec: RunSpec, context: ChildContext) -> RunOutcome:
    """Do the run that the spec describes: build its problem, run its method on it, and compute its reference scores."""
    from zoobench.cell.problem import Problem
    from zoobench.cell.references import reference_scores

    first = named_run(spec.method)
    problem = Problem(spec, start=solution_in(run_name(first)) if first else None)
    if problem.overlay is not None:
        print(f"Warm start: {problem.overlay.words}.")
    context.parameter_count = problem.parameter_count
    for note in problem.body.notes:
        print(note)
    method: Method = registry.create(Kind.METHOD, spec.method)
    solution = method.run(problem, context)
    if again := problem.meter.recomputed:
        print(f"{again:,} substeps were simulated again for gradients, whose states did not fit into --memory.")
    if context.should_stop():
        raise StoppedError  # what it has so far is no result
    solution = repeated(problem, solution)
    design = solution.params[problem.robot.control_count :]
    references = {} if _is_study(spec) else reference_scores(spec, design, context)
    archive = None if solution.archive is None else base64.b64encode(solution.archive.to_bytes()).decode()
    return RunOutcome(finals_of(problem, solution, references), solution.params.tolist(), archive)


def serve(solve: Callable[[RunSpec, ChildContext], RunOutcome], load: Callable[[], object] = lambda: None) -> None:
    """Do the jobs from standard input with `solve`, once all that they need is loaded, and report their endings."""
    stay_guarded()
    orders = Orders()
    Lifeline(take_standard_input()).watch(on_line=orders.hear, on_end=orders.end)
    wire = Wire()
    load()
    surroundings, memory = Surroundings(), memory_of(os.getpid())
    for number in count(1):
        if (job := orders.job()) is None:
            break
        begin_account()
        goes_on = _do(job, solve, wire, orders)
        gc.collect()
        growth = memory_of(os.getpid()) - memory
        if not goes_on or number == _MOST_RUNS or growth > _bearable_growth() or not surroundings.are_back():
            break
        orders.finish_run()
        wire.end_log(job["log_end"])
    end_descendants()


def _bearable_growth() -> float:
    """Memory that a run may leave for the next to have less [bytes]: little of a limit, if there is one."""
    limit = allowed()
    return _MOST_GROWTH if limit is None else min(_MOST_GROWTH, 0.1 * limit)


def _do(job: dict[str, Any], solve: Callable[[RunSpec, ChildContext], RunOutcome], wire: Wire, orders: Orders) -> bool:
    """Do a run and report its ending; whether this process may do another after it."""
    checkpoint = None if job["checkpoint"] is None else base64.b64decode(job["checkpoint"])
    last_word: dict[str, Any]
    try:
        spec = RunSpec.from_dict(job["spec"])
        stored = [
            Start(RunSpec.from_dict(each["spec"]), tuple(each["params"]), tuple(map(tuple, each["milestones"])))
            for each in job["stored"]
        ]
        find_with({run_name(start.spec.key()): start for start in stored}.get)
        last_word = {"kind": "done", **solve(spec, ChildContext(spec, wire, checkpoint, orders))._asdict()}
    except StoppedError:
        last_word = {"kind": "stopped"}
    except DivergenceError as error:
        last_word = {"kind": "diverged", "reason": str(error)}
    except Exception as error:
        reason = str(error) if isinstance(error, ZoobenchError) else f"{type(error).__name__}: {error}"
        last_word = {"kind": "failed", "reason": reason, "traceback": traceback.format_exc()}
    # A method that was asked to stop returns early: neither its solution nor a divergence so far is the result.
    if orders.stop.is_set() and last_word["kind"] != "failed":
        last_word = {"kind": "stopped"}
    wire.send(**last_word, peak_memory=peak_memory())
    return last_word["kind"] in ("done", "diverged") and not needs_own_process(spec, stored)


def needs_own_process(spec: RunSpec, stored: Sequence[Start]) -> bool:
    """Whether the process of a run is to do no other: with a GPU, or where other code than zoobench's takes part.

    That is code of plug-ins, also of those in the stored runs that it names, and agents from outside. It may do to a
    process what it likes.
    """
    tags = registry.get(Kind.METHOD, spec.method.name, spec.method.version).tags
    return on_gpu(spec) or "external" in tags or any(map(plugins_of, (spec, *(each.spec for each in stored))))


if __name__ == "__main__":
    serve(solve, load_simulator)
