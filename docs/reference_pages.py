"""Pages of the reference that are made from the code: observations, environment variables, suite files, database."""

import inspect
from collections.abc import Iterable, Mapping, Sequence
from itertools import takewhile
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel
from sqlalchemy import Column

from zoobench import registry, rounding
from zoobench.cell.robot import Robot
from zoobench.cell.vector_parts import Action, VectorPart, action_parts, observation_parts
from zoobench.db.models import Base
from zoobench.harness.provenance import THREAD_VARIABLES
from zoobench.harness.suite_file import GridSettings, SuiteFile
from zoobench.registry import Kind
from zoobench.spec import Ref

SUITES = Path(__file__).parents[1] / "zoobench" / "suites"

BODY = "caterpillar"
"""Of which the places in the vectors are told."""

MIXTURE = "mix[movement-speed=1,final-position=1]"
"""In place of a task that is nothing without settings."""

HEADS = ("slice", "name", "shape", "unit", "meaning")

_CHILDREN = "Set by zoobench for its workers; set it yourself for a program that calls the simulator."
_ROUNDING = "The code that a numerical library chooses, so that results repeat on every x86 processor."

VARIABLES: Mapping[str, tuple[str, str]] = {
    "ZOOBENCH_DB": ("The database of every command, in place of `--db`: a path or a PostgreSQL URL.", "`zoobench.db`"),
    "ZOOBENCH_CACHE": (
        "The folder of compiled kernels, of scenes at rest, and of what else can be made again.",
        "`zoobench` in the folder that `XDG_CACHE_HOME` names",
    ),
    "XDG_CACHE_HOME": ("The user's cache folder.", "`~/.cache`"),
    "ZOOBENCH_MEMORY": ("Memory that each process of a run may take, as `--memory`: `2GB`.", "no limit"),
    "ZOOBENCH_WORKERS": (f"By how many processes the free memory is shared. {_CHILDREN}", "`1`"),
    **dict.fromkeys(THREAD_VARIABLES, (f"Threads of a numerical library. {_CHILDREN}", "as the library decides")),
    **{name: (_ROUNDING, f"`{value}`") for name, value in rounding.CHOICES.items()},
    "ENABLE_TAICHI_HEADER_PRINT": ("Whether Taichi prints its version when it is loaded.", "`False`"),
    "TI_SKIP_VERSION_CHECK": ("`ON` keeps Taichi from asking its server for newer versions once a day.", "`ON`"),
    "ZOOBENCH_DEBUG": ("With any text, kernels check every access to an array against its bounds. Slow.", "off"),
    "ZOOBENCH_QUICK_COMPILE": ("With any text, kernels compile faster and run slower, as in tests.", "off"),
}
"""What each environment variable is for, and what holds where it is not set."""


def pages() -> dict[str, str]:
    """The pages by their place in the site."""
    return {
        "reference/observations.md": observations(),
        "reference/environment-variables.md": environment_variables(),
        "reference/suite-files.md": suite_files(),
        "reference/database.md": database(),
    }


def observations() -> str:
    """Observations and actions of every task."""
    muscles = _muscles()
    texts = [MIXTURE if registry.get(Kind.TASK, name).needs_settings else name for name in registry.names(Kind.TASK)]
    tasks = {text: registry.create(Kind.TASK, Ref.parse(text)) for text in texts}
    rows = {
        text: _rows(observation_parts(muscles, task), observation_parts(muscles + 1, task))
        for text, task in tasks.items()
    }
    shared = [row for row, *_ in takewhile(lambda each: len(set(each)) == 1, zip(*rows.values(), strict=False))]
    parts = [
        "# Observations and actions\n",
        f"A policy observes one flat vector and acts by another, once in every control frame. These tables say which "
        f"of their numbers are what. The slices are those of the {BODY}, which has {muscles} muscles; of any body "
        f"`env.unwrapped.observation_parts` and `action_parts` tell them, see "
        f"[reinforcement learning](../guide/reinforcement-learning.md).\n",
        f"## Every observation begins with the body\n\n{_table(HEADS, shared)}",
        "## Then comes what the task adds\n\nThe time left and the phase of the waves are the end of all.\n",
    ]
    for text, task in tasks.items():
        reward = "a pure number" if task.unit == "1" else f"in {task.unit}"
        parts.append(f"### {text}\n\nIts reward is {reward}.\n\n{_table(HEADS, rows[text][len(shared) :])}")
    parts.append("## Actions\n\nThey are the same for every task, in [-1, 1].\n")
    for action in get_args(Action):
        table = _table(HEADS, _rows(action_parts(muscles, action), action_parts(muscles + 1, action)))
        parts.append(f'### `action="{action}"`{", the usual one" * (action == "waves")}\n\n{table}')
    return "\n".join(parts)


def environment_variables() -> str:
    """Every environment variable that the code reads."""
    lead = "# Environment variables\n\nNone has to be set. These change where zoobench keeps things, and how it runs.\n"
    rows = ((f"`{name}`", meaning, unset) for name, (meaning, unset) in VARIABLES.items())
    return "\n".join([lead, _table(("variable", "what it is for", "where it is not set"), rows)])


def suite_files() -> str:
    """Every key of a suite file, with a whole one as example."""
    example = (SUITES / "smoke.yaml").read_text(encoding="utf-8")
    return "\n".join(
        [
            "# Suite files\n",
            "A suite file is YAML that lists grids of runs, the most valuable first; `zoobench run --suite FILE` does "
            "them all. Each grid stands for every combination of what it names. A key that is unknown, or stands "
            "twice, is refused with its place.\n",
            f"## Example\n\nThe suite `smoke`, in full:\n\n```yaml\n{example}```\n",
            f"## Keys of the file\n\n{_keys(SuiteFile, 'none')}",
            "## Keys of a grid, and of `common`\n\nA grid must have every one, of its own or from `common`; `part` "
            "alone is left out where the file has no `parts`.\n",
            _keys(GridSettings, "that of `common`"),
        ]
    )


def database() -> str:
    """Every table of the database with its columns."""
    parts = [
        "# The database\n",
        "A database holds these tables, in SQLite and in PostgreSQL alike. Times are in seconds since the epoch. "
        'To read results, [from Python](../tutorials/pandas.md) is easier: `zoobench.load("zoobench.db").tidy()`. '
        "Nobody but zoobench should write: every run that has ended has a digest. "
        "[How results are kept](../guide/storage.md) tells more.\n",
    ]
    for mapper in sorted(Base.registry.mappers, key=lambda each: str(each.local_table)):
        rows = ((f"`{column.name}`", _type(column), column.doc or "") for column in mapper.local_table.columns)
        meaning = inspect.getdoc(mapper.class_) or ""
        parts.append(f"## {mapper.local_table}\n\n{meaning}\n\n{_table(('column', 'type', 'meaning'), rows)}")
    return "\n".join(parts)


def _muscles() -> int:
    texts = {Kind.DESIGN: BODY, Kind.CONTROLLER: "policy-network", Kind.TASK: "turning"}
    design, controller, task = (registry.get(kind, name).ref for kind, name in texts.items())
    fidelity = registry.create(Kind.FIDELITY, registry.get(Kind.FIDELITY, "smoke").ref)
    return Robot.of(design, controller, fidelity, task).body.muscle_count


def _rows(parts: Sequence[VectorPart], of_one_more: Sequence[VectorPart]) -> list[tuple[str, ...]]:
    """Rows for parts; the side of a shape that grows with `of_one_more` muscle is their number."""
    rows = []
    for part, longer in zip(parts, of_one_more, strict=True):
        sides = zip(part.shape, longer.shape, strict=True)
        shape = " x ".join("muscles" if side != other else str(side) for side, other in sides)
        rows.append((f"{part.start}:{part.stop}", f"`{part.name}`", shape, part.unit, part.meaning))
    return rows


def _keys(model: type[BaseModel], missing: str) -> str:
    """A table of the keys of a mapping."""
    schemas = model.model_json_schema()["properties"]
    rows = []
    for name, field in model.model_fields.items():
        default = "must be given" if field.is_required() else missing
        rows.append((f"`{name}`", _kind(schemas[name]), default, field.description or ""))
    return _table(("key", "type", "default", "what it takes"), rows)


def _kind(schema: Mapping[str, Any]) -> str:
    """The type of a key in words, from its JSON schema."""
    if "anyOf" in schema:
        kinds = [_kind(each) for each in schema["anyOf"] if each.get("type") != "null"]
        return " or ".join(kind for kind in kinds if kind != "whole number" or "number" not in kinds)
    if "$ref" in schema:
        return "mapping"
    if schema["type"] == "array":
        return f"list of {_kind(schema['items'])}s"
    if schema["type"] == "object":
        return f"mapping of name to {_kind(schema['additionalProperties'])}"
    return {"string": "text", "integer": "whole number", "number": "number"}[schema["type"]]


def _type(column: "Column[Any]") -> str:
    """The type of a column, and whether it may be empty."""
    notes = ["key"] * column.primary_key + [f"of `{each.column.table.name}`" for each in column.foreign_keys]
    return ", ".join([str(column.type).lower(), *notes, *(["or empty"] * bool(column.nullable))])


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '&#124;') for cell in line)} |" for line in lines) + "\n"
