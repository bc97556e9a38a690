"""Components of a distribution of a third party, installed by pip, in real processes."""

import base64
import hashlib
import json
import os
import subprocess
import sys
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Reply

GOOD = '''
"""A moon to hop on, a brick, and a method that is content with its first draw."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from zoobench.designs.block import Block
from zoobench.envs.base import LAND_ROBOT, OPEN_ARENA, Environment
from zoobench.methods.base import Incumbent, RunContext, Solution, keep, resume
from zoobench.cell.problem import Problem
from zoobench.registry import Kind, register
from zoobench.tasks.base import Motion

if TYPE_CHECKING:  # most commands need no tensors, and it takes them seconds to load
    import torch


@register(Kind.ENV, "moon", tags=("land",))
def moon(*, friction: float = 0.3) -> Environment:
    """Dust on rock."""
    return Environment(robot=LAND_ROBOT, friction=friction, arena=OPEN_ARENA)


@register(Kind.TASK, "hopping")
@dataclass(frozen=True, kw_only=True)
class Hopping:
    """Rise as fast as possible."""

    unit: ClassVar[str] = "m/s"

    def reward(self, motion: Motion) -> "torch.Tensor":
        return motion.mean_over_existing(motion.velocities[1:])[..., 1]

    def score(self, motion: Motion) -> "torch.Tensor":
        return self.reward(motion).mean(dim=0)

    def objective(self, motion: Motion) -> "torch.Tensor":
        return self.score(motion)

    def metrics(self, motion: Motion) -> Mapping[str, tuple["torch.Tensor", str]]:
        return {}


@register(Kind.DESIGN, "brick", tags=("land",))
def brick(*, length: float = 0.1) -> Block:
    """One muscle."""
    return Block(length=length, rows=1, columns=1, layers=1)


@register(Kind.METHOD, "content")
@dataclass(frozen=True, kw_only=True)
class Content:
    """Draw once."""

    def run(self, problem: Problem, context: RunContext) -> Solution:
        incumbent = resume(problem, context)
        params = problem.initial(context.rng)
        incumbent.offer(params, problem.evaluate(params))
        problem.meter.iterations += 1
        context.report(1, score=incumbent.score)
        keep(problem, context, incumbent)
        return incumbent.solution()
'''

GOOD_POINTS = {"envs": "moon", "tasks": "hopping", "designs": "brick", "methods": "content"}

_REGISTER = "from zoobench.registry import Kind, register\n\n\n@register(Kind.METHOD, '{}')\ndef other() -> None: ...\n"
BROKEN = {
    "import_error": ("import a_library_that_is_not_there\n", "a_library_that_is_not_there"),
    "exits": ("raise SystemExit('a script, not a module')\n", "a script, not a module"),
    "taken_name": (_REGISTER.format("random"), "registered already"),
    "odd_name": (_REGISTER.format("Odd Name"), "kebab-case"),
    "loose": (_REGISTER.format("loose").replace("()", "(**anything)"), "Name every parameter"),
    "absent": (None, "No module named"),
}
"""Modules of a distribution in which nothing works, and what the doctor is to say of each."""


def build(name: str, modules: Mapping[str, str], entry_points: str, folder: Path) -> Path:
    """A wheel of these modules."""
    info = f"{name}-1.0.dist-info"
    files = {f"{module}.py": source for module, source in modules.items()} | {
        f"{info}/METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\nRequires-Dist: zoobench\n",
        f"{info}/WHEEL": "Wheel-Version: 1.0\nGenerator: a test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        f"{info}/entry_points.txt": entry_points,
    }
    record = [f"{path},sha256={_digest(text)},{len(text.encode())}\n" for path, text in files.items()]
    wheel = folder / f"{name}-1.0-py3-none-any.whl"
    with zipfile.ZipFile(wheel, "w") as archive:
        for path, text in files.items():
            archive.writestr(path, text)
        archive.writestr(f"{info}/RECORD", "".join([*record, f"{info}/RECORD,,\n"]))
    return wheel


def _digest(text: str) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(text.encode()).digest()).rstrip(b"=").decode()


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a working and a broken distribution."""
    folder = tmp_path_factory.mktemp("plugins")
    target = folder / "site"
    sound = "".join(f"[zoobench.{kind}]\n{name} = zoo_moon\n" for kind, name in GOOD_POINTS.items())
    wheels = [build("zoo_moon", {"zoo_moon": GOOD}, sound, folder)]
    modules = {f"zoo_{name}": source for name, (source, _) in BROKEN.items() if source is not None}
    broken = "[zoobench.methods]\n" + "".join(f"{name} = zoo_{name}\n" for name in BROKEN)
    wheels.append(build("zoo_broken", modules, broken, folder))
    words = ["install", "--quiet", "--no-deps", "--no-index", "--disable-pip-version-check", "--target", target]
    subprocess.run([sys.executable, "-m", "pip", *words, *wheels], check=True, capture_output=True)
    return target


_COMMANDS = """
import io, json, sys
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from tests.harness.helpers import fake
from zoobench.cli.main import main
from zoobench.harness import worker
from zoobench.harness import doctor

doctor._check_taichi = lambda: iter(())
worker.WorkerOrders = partial(worker.WorkerOrders, child=fake())
replies = []
for words in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        try:
            code = main(words)
        except SystemExit as end:
            code = end.code or 0
    replies.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(replies))
"""
"""Commands one after the other; the doctor does without what takes seconds, and `work` without the simulator."""


def zoobench(site: Path, *commands: Sequence[str]) -> list[Reply]:
    """Command lines in one process that finds the plug-ins, and knows their code as it is when it begins."""
    path = os.pathsep.join([str(site), str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    environ = {**os.environ, "PYTHONPATH": path, "ZOOBENCH_DB": str(site.parent / "zoobench.db")}
    program = [sys.executable, "-c", _COMMANDS, json.dumps(commands)]
    done = subprocess.run(program, capture_output=True, text=True, check=True, cwd=site.parent, env=environ)
    return [Reply(*each) for each in json.loads(done.stdout)]


@pytest.mark.slow
def test_a_plugin_is_listed_runs_and_is_in_the_table(site: Path) -> None:
    """An environment, a task, a design and a method from outside make a cell like any other, broken ones beside them.

    Where a broken one claims the name of a method that is there, that stays what it is.
    """
    cell = ("--env", "moon[friction=0.2]", "--task", "hopping", "--design", "brick", "--method", "content")
    size = ("--fidelity", "draft", "--frames", "4", "--budget", "2 episodes", "--seeds", "1")
    asked = (("run", *cell, *size, "-j", "1"), ("list", "--format", "json"), ("show", "1", "--format", "json"))
    run, listed, shown = zoobench(site, *asked)
    assert (run.code, listed.code) == (0, 0), run.err + listed.err
    found = {(item["kind"], item["name"]) for item in json.loads(listed.out)}
    assert set(GOOD_POINTS.items()) <= found
    assert {("envs", "ground"), ("methods", "ppo"), ("designs", "panda")} <= found
    for name, (_, reason) in BROKEN.items():
        told = next(line for line in run.err.splitlines() if f"plug-in {name} of zoobench.methods" in line)
        assert reason in told
    (attempt,) = json.loads(shown.out)["attempts"]
    told = attempt["provenance"]["plugins"]
    assert told.keys() == {"environment moon-v1", "task hopping-v1", "design brick-v1", "method content-v1"}
    assert {(each["distribution"], each["version"]) for each in told.values()} == {("zoo_moon", "1.0")}
    assert {len(each["code"]) for each in told.values()} == {64}
    assert "has changed" not in run.err


@pytest.mark.slow  # six commands, each of which loads the simulator or the statistics
def test_a_plugin_whose_code_has_changed_is_told_of(site: Path) -> None:
    """By every command that queues, does or compares its runs, and in the table beside what it has done."""
    cell = ("--env", "moon[friction=0.2]", "--task", "hopping", "--design", "brick", "--method", "content")
    size = ("--fidelity", "draft", "--frames", "4", "--budget", "2 episodes", "--seeds", "1")
    (run,) = zoobench(site, ("run", *cell, *size, "-j", "1"))
    assert run.code == 0, run.err
    module = site / "zoo_moon.py"
    module.write_text(GOOD.replace("Draw once.", "Draw but once."))
    more = (*cell, *size[:-1], "2")
    replies = zoobench(site, ("run", *more, "--no-wait"), ("run", "--dry-run", *more), ("table",), ("work",))
    module.write_text(GOOD)
    warning = "The code of the environment moon-v1, of zoo_moon 1.0, has changed"
    assert [reply.err.count(warning) for reply in replies] == [1, 1, 1, 1]
    assert "environment moon-v1 of zoo_moon 1.0, code" in replies[2].out
    assert "CHANGED" not in replies[2].out
    both, listing = zoobench(site, ("table",), ("table", "--format", "json"))
    assert both.out.count("(CHANGED between runs)") == 4
    assert warning not in both.err
    cells = json.loads(listing.out)["cells"]
    assert {cell["method"].partition("-v")[0] for cell in cells} == {"content"}
    assert all(cell["env"].startswith("moon") and cell["design"].startswith("brick") for cell in cells)


def test_the_doctor_names_what_is_broken(site: Path) -> None:
    """Each broken entry point with its reason, and exit code 1; working ones are not listed."""
    (reply,) = zoobench(site, ("doctor", "--format", "json"))
    assert reply.code == 1
    (check,) = (check for check in json.loads(reply.out) if check["check"] == "plug-ins")
    assert check["verdict"] == "problem"
    told = dict(part.split(" of zoobench.methods: ") for part in check["detail"].split("; "))
    assert told.keys() == BROKEN.keys()
    for name, (_, reason) in BROKEN.items():
        assert reason in told[name]
