"""Suites: benchmarks as files. A file states grids in order of value; its runs are queued in that order.

```yaml
summary: what it is for
common:                      # settings of every grid that does not state its own
  controllers: sine-basis    # one reference or a list, as on the command line
  methods: ["diffphysics[restarts=1]", random]
  seeds: 3                   # how many, or a list of which
  budget: {snow: 540000 substeps, "*": 126000 substeps}  # one for all, or by environment: the first that fits
  fidelity: standard
  frames: 100
grids:
  - {envs: [ground, ice], tasks: turning, designs: caterpillar}
```
"""

from collections.abc import Callable, Hashable, Iterator, Mapping
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from importlib import resources
from pathlib import Path
from typing import Any

import yaml

from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness.grid import MOST_SEEDS, GridSpec, Skip, expand, parse_one, parse_selector
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec

ENDINGS = (".yaml", ".yml")
_AXES = {
    "envs": Kind.ENV,
    "tasks": Kind.TASK,
    "designs": Kind.DESIGN,
    "controllers": Kind.CONTROLLER,
    "methods": Kind.METHOD,
}
_KEYS = (*_AXES, "seeds", "budget", "fidelity", "frames")


@dataclass(frozen=True)
class Suite:
    """A benchmark.

    Attributes:
        name: of the file, without its ending.
        source: what `--suite` takes; of a file that is not the package's, the file's name without its folder.
        cells: every run once, the most valuable first.
    """

    name: str
    source: str
    summary: str
    cells: tuple[RunSpec | Skip, ...]

    @property
    def specs(self) -> tuple[RunSpec, ...]:
        """All runs, those that cannot be done included."""
        return tuple(spec_of(cell) for cell in self.cells)


def spec_of(cell: RunSpec | Skip) -> RunSpec:
    """The run of a cell, whether it can be done or not."""
    return cell.spec if isinstance(cell, Skip) else cell


def names() -> list[str]:
    """The names of the suites that come with the package."""
    return sorted(path.name.rpartition(".")[0] for path in _shipped().iterdir() if path.name.endswith(ENDINGS))


def summary(name: str) -> str:
    """What a suite of the package is for; its grids are not looked at."""
    return _summary(_parse((_shipped() / f"{name}.yaml").read_text(encoding="utf-8"), f"{name}.yaml"), f"{name}.yaml")


def load(text: str) -> Suite:
    """The suite of that name, or in the file of that path if it ends in `.yaml`.

    Raises:
        UnknownNameError: no suite has this name; suggests the nearest.
        UsageError: the file cannot be read, or says what no suite says: names file, key, and what was expected.
    """
    if not text.endswith(ENDINGS):
        if text not in names():
            raise UnknownNameError("suite", text, names())
        return read((_shipped() / f"{text}.yaml").read_text(encoding="utf-8"), f"{text}.yaml", source=text)
    path = Path(text)
    try:
        content = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"Cannot read the suite {text!r}: {error}.") from None
    return read(content, path.name, source=path.name)


def read(content: str, file: str, *, source: str) -> Suite:
    """The suite that a file's content describes; raises UsageError as `load`."""
    document = _parse(content, file)
    _check_keys(document, ("summary", "common", "grids"), file)
    text = _summary(document, file)
    common = _mapping(document.get("common", {}), f"{file}, common")
    _check_keys(common, _KEYS, f"{file}, common")
    grids = document.get("grids")
    if not isinstance(grids, list) or not grids:
        raise UsageError(f"{file}, grids: {_shown(grids)}, expected a list of at least one grid.")
    cells: dict[str, RunSpec | Skip] = {}
    for number, grid in enumerate(grids, start=1):
        where = f"{file}, grid {number}"
        own = _mapping(grid, where)
        _check_keys(own, _KEYS, where)
        for cell in _cells({**common, **own}, where):
            cells.setdefault(spec_of(cell).key(), cell)
    return Suite(file.rpartition(".")[0], source, text, tuple(cells.values()))


def _shipped() -> Any:
    return resources.files("zoobench") / "suites"


class _Loader(yaml.SafeLoader):
    """YAML in which a key may not come twice: the first would be lost in silence."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key.value!r} comes twice", key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


def _parse(content: str, file: str) -> Mapping[str, Any]:
    try:
        # A SafeLoader: nothing but plain data comes from a file.
        document = yaml.load(content, _Loader)
    except yaml.YAMLError as error:
        raise UsageError(f"Cannot read {file} as YAML: {' '.join(str(error).split())}.") from None
    return _mapping(document, file)


def _mapping(value: Any, where: str) -> Mapping[str, Any]:
    if not isinstance(value, dict):
        raise UsageError(f"{where}: {_shown(value)}, expected keys with values.")
    return value


def _check_keys(given: Mapping[str, Any], known: tuple[str, ...], where: str) -> None:
    for key in given:
        if key not in known:
            raise UnknownNameError(f"key in {where}:", str(key), known)


def _summary(document: Mapping[str, Any], file: str) -> str:
    text = document.get("summary")
    if not isinstance(text, str) or not text.strip():
        raise UsageError(f"{file}, summary: {_shown(text)}, expected a line of text.")
    return " ".join(text.split())


def _shown(value: Any) -> str:
    return "nothing" if value is None else f"{value!r}"


def _cells(given: Mapping[str, Any], where: str) -> Iterator[RunSpec | Skip]:
    """The runs of one grid, environment by environment where each has a budget of its own."""
    for key in _KEYS:
        if key not in given:
            raise UsageError(f"{where}, {key}: nothing, expected a value here or in `common`.")
    axes = {key: _at(f"{where}, {key}", _refs, given[key], kind) for key, kind in _AXES.items()}
    grid = GridSpec(
        **axes,
        seeds=_at(f"{where}, seeds", _seeds, given["seeds"]),
        budget=Budget("substeps", 1),
        fidelity=_at(f"{where}, fidelity", lambda text: parse_one(_text(text), Kind.FIDELITY), given["fidelity"]),
        frames=_at(f"{where}, frames", _positive, given["frames"]),
    )
    budgets = _at(f"{where}, budget", _budgets, given["budget"], grid.envs)
    for env, budget in budgets.items():
        yield from _at(where, expand, replace(grid, envs=(env,), budget=budget))


def _at(where: str, convert: Callable[..., Any], *values: Any) -> Any:
    """What `convert` makes of the values; its refusals are told with the place in the file."""
    try:
        return convert(*values)
    except UsageError as error:
        raise UsageError(f"{where}: {error}") from None


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise UsageError(f"{_shown(value)}, expected text.")
    return value


def _refs(value: Any, kind: Kind) -> tuple[Ref, ...]:
    items = value if isinstance(value, list) else [value]
    if not items or not all(isinstance(item, str) for item in items):
        raise UsageError(
            f"{_shown(value)}, expected a name as `zoobench list {kind.value}` shows them, or a list of names."
        )
    return tuple(dict.fromkeys(ref for item in items for ref in parse_selector(item, kind)))


def _seeds(value: Any) -> tuple[int, ...]:
    if isinstance(value, list) and value and all(_is_whole(item) and item >= 0 for item in value):
        return tuple(dict.fromkeys(value))
    if _is_whole(value) and 1 <= value <= MOST_SEEDS:
        return tuple(range(value))
    raise UsageError(f"{_shown(value)}, expected how many seeds (3, at most {MOST_SEEDS:,}) or which ([0, 1, 2]).")


def _positive(value: Any) -> int:
    if not _is_whole(value) or value < 1:
        raise UsageError(f"{_shown(value)}, expected a whole number from 1 upwards.")
    return int(value)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _budgets(value: Any, envs: tuple[Ref, ...]) -> dict[Ref, Budget]:
    """The budget of each environment; of a mapping, the first whose name or pattern fits."""
    if not isinstance(value, dict):
        return dict.fromkeys(envs, _budget(value))
    patterns = {_text(pattern): _budget(amount) for pattern, amount in value.items()}
    found = {env: next((patterns[each] for each in patterns if fnmatchcase(env.name, each)), None) for env in envs}
    if without := [env.name for env, budget in found.items() if budget is None]:
        raise UsageError(f"nothing for {', '.join(without)}, expected a budget for each environment, or for '*'.")
    return {env: budget for env, budget in found.items() if budget is not None}


def _budget(value: Any) -> Budget:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise UsageError(f"{_shown(value)}, expected a budget such as '126000 substeps' or '60 seconds'.")
    return Budget.parse(str(value))
