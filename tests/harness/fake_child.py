"""A child process with a small deterministic method instead of the simulator: `fake_child.py MODE ITERATIONS PAUSE`.

MODE says how it ends: `steady` (well), or `fail`, `diverge`, `vanish`, `segfault`, `hang` at half of its iterations, or
`blind`: it diverges when it ends early, as a method does that has met nothing else so far. `refers` is steady and
shares a reference score, the number of the process that computed it, in a second.
"""

import os
import pickle
import signal
import sys
import time

from zoobench.errors import Divergence, DivergenceError
from zoobench.harness.child import ChildContext, RunOutcome, serve
from zoobench.harness.finals import Final
from zoobench.spec import RunSpec
from zoobench.tasks.base import Metric


def solve(spec: RunSpec, context: ChildContext) -> RunOutcome:
    """A random walk; the score is where it ends, and so is the solution."""
    mode, iterations, pause = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    print("a word on standard output")
    step, position = 0, 0.0
    if (stored := context.restore()) is not None:
        step, position, context.rng.bit_generator.state = pickle.loads(stored)
    while step < iterations and not context.should_stop():
        if step == iterations // 2 and mode != "blind":
            _end(mode)
        time.sleep(pause)
        position += context.rng.standard_normal()
        step += 1
        context.report(step, position=position, square=position**2)
        context.progress(step / iterations, position)
        context.checkpoint(pickle.dumps((step, position, context.rng.bit_generator.state)))
    if mode == "blind" and step < iterations:
        _end(mode)
    if mode == "refers":
        return RunOutcome([("score", position, "m"), *_reference(context)], [position])
    return RunOutcome([("score", position, "m"), ("iterations", float(step), "")], [position])


def _reference(context: ChildContext) -> list[Final]:
    score = context.reference("a reference")
    computed = score is None
    if score is None:
        time.sleep(1.0)
        score = Metric(float(os.getpid()), "kg")
        context.keep_reference("a reference", score)
    return [("computed", float(computed), ""), ("reference", score.value, score.unit)]


def _end(mode: str) -> None:
    if mode == "fail":
        raise ValueError("the middle of the walk")
    if mode in ("diverge", "blind"):
        place = (0.0, 0.0, 0.0)
        raise DivergenceError(Divergence(0, 1, 2, "det F", -1.0, 0.0, 3, place, "Take a smaller step."))
    if mode == "vanish":
        print("last words", file=sys.stderr, flush=True)
        os._exit(7)
    if mode == "segfault":
        os.kill(os.getpid(), signal.SIGSEGV)
    if mode == "hang":
        time.sleep(3600)


serve(solve)
