"""The page that says what stands for the tasks of other benchmarks."""

import itertools
import re
from pathlib import Path

import pytest

from tests.conformance.cells import cell
from zoobench import registry
from zoobench.cell.scene_fault import scene_fault
from zoobench.cell.task_fault import task_fault
from zoobench.registry import Kind
from zoobench.spec import Ref

PAGE = Path(__file__).parents[2] / "docs" / "guide" / "other-benchmarks.md"
ROWS = [line.split("|")[1:5] for line in PAGE.read_text().splitlines() if line.startswith("| ")]
STATED = [row for row in ROWS if "`" in row[1]]


@pytest.mark.parametrize("row", STATED, ids=lambda row: row[0].strip())
def test_what_stands_for_a_task_is_possible(row: list[str]) -> None:
    """Environment, task and design exist with their parameters, and nothing in them is refused at `draft`."""
    environments, (task, *others) = re.findall("`([^`]+)`", row[1]), re.findall("`([^`]+)`", row[2])
    tasks = [task, *(name for name in others if name.startswith(task.partition("[")[0]))]
    designs = [name for name in others if name not in tasks] or ["caterpillar"]
    for env, task, design in itertools.product(environments, tasks, designs):
        for kind, name in ((Kind.ENV, env), (Kind.TASK, task), (Kind.DESIGN, design)):
            registry.create(kind, Ref.parse(name))
        spec = cell(environment=env, task=task, design=design, fidelity="draft", frames=200)
        assert not scene_fault(spec)
        assert not task_fault(spec)


def test_the_count_of_the_page_is_that_of_its_rows() -> None:
    """Of EvoGym's 32 tasks; a row may have several."""
    table = PAGE.read_text().partition("## SoMoGym")[0]
    rows = [line.split("|")[1:3] for line in table.splitlines() if re.match(r"\| [A-Z].*-v\d", line)]
    assert len(rows) > 20
    counts = [len(re.findall(r"v\d", names)) for names, _ in rows]
    found = sum(count for count, (_, env) in zip(counts, rows, strict=True) if "`" in env)
    assert sum(counts) == 32
    assert found == 32
    assert "All 32 of them" in PAGE.read_text()
