"""Suites: benchmarks as YAML files. A file states grids in order of value; its runs are queued in that order.

```yaml
summary: its purpose
common:                      # settings of every grid that does not state its own
  controllers: sine-basis    # one reference or a list, as on the command line
  methods: ["diffphysics[restarts=1]", random]
  seeds: 3                   # how many, or a list of which
  budget: {snow: 540000 substeps, "*": 126000 substeps}  # one for all, or by environment: the first that fits
  fidelity: standard         # likewise
  frames: 100
grids:
  - {envs: [ground, ice], tasks: turning, designs: caterpillar}
```

A reference may name a published solution, as `stored[run=best:codesign/ocean/movement-speed/sdf-lerp]`.

A suite may have parts, each with its purpose, which can be run alone, as `--suite paper/design`: `parts: {design: ...}`
beside the summary, and `part: design` in every grid.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

from zoobench import registry
from zoobench.errors import UnknownNameError, UsageError, reason
from zoobench.harness.grid import GridSpec, Skip, expand, parse_one, parse_selector
from zoobench.harness.starts import pinned_published
from zoobench.registry import Kind
from zoobench.spec import Budget, Ref, RunSpec, Selector

ENDINGS = (".yaml", ".yml")
_AXES = {
    "envs": Kind.ENV,
    "tasks": Kind.TASK,
    "designs": Kind.DESIGN,
    "controllers": Kind.CONTROLLER,
    "methods": Kind.METHOD,
}


@dataclass(frozen=True)
class Suite:
    """A benchmark.

    Attributes:
        name: of the file, without its ending.
        source: what `--suite` takes; of a file that is not the package's, the file's name without its folder.
        cells: every run once, the most valuable first.
        parts: the keys of the runs of each part, by name; empty if there are no parts.
    """

    name: str
    source: str
    summary: str
    cells: tuple[RunSpec | Skip, ...]
    parts: Mapping[str, frozenset[str]] = field(default_factory=dict)

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


def summaries(name: str) -> dict[str, str]:
    """The purpose of a suite of the package and of its parts, as `--suite` takes them; no reference is read."""
    from zoobench.harness import suite_file

    found = suite_file.parse((_shipped() / f"{name}.yaml").read_text(encoding="utf-8"), f"{name}.yaml")
    return {name: _line(found.summary), **{f"{name}/{part}": _line(text) for part, text in found.parts.items()}}


def load(text: str) -> Suite:
    """The suite of that name, or in the file of that path if it ends in `.yaml`; of `suite/part` that part.

    Raises:
        UnknownNameError: no suite, or no part of it, has this name; suggests the nearest.
        UsageError: the file cannot be read or is no suite: names file, grid, key, and what was expected.
    """
    whole, slash, part = text.rpartition("/")
    if slash and (whole in names() or whole.endswith(ENDINGS)):
        return _part(load(whole), part)
    if not text.endswith(ENDINGS):
        if text not in names():
            raise UnknownNameError("suite", text, names())
        return read((_shipped() / f"{text}.yaml").read_text(encoding="utf-8"), f"{text}.yaml", source=text)
    path = Path(text)
    try:
        content = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(
            f"Cannot read the suite {text!r}: {reason(error)}. Give a YAML file, or a name of `zoobench list suites`."
        ) from None
    return read(content, path.name, source=path.name)


def read(content: str, file: str, *, source: str) -> Suite:
    """The suite that a file's content describes; raises UsageError as `load`."""
    from zoobench.harness import suite_file

    document = suite_file.parse(content, file)
    cells: dict[str, RunSpec | Skip] = {}
    parts: dict[str, set[str]] = {name: set() for name in document.parts}
    for number, settings in enumerate(document.merged(), start=1):
        part = settings.pop("part")
        for cell in _cells(settings, f"{file}, grid {number}"):
            key = spec_of(cell).key()
            cells.setdefault(key, cell)
            if part is not None:
                parts[part].add(key)
    keys = {name: frozenset(found) for name, found in parts.items()}
    return Suite(file.rpartition(".")[0], source, _line(document.summary), tuple(cells.values()), keys)


def _part(suite: Suite, name: str) -> Suite:
    """A part of a suite as a suite of its own, without parts.

    Raises:
        UnknownNameError: the suite has no such part; suggests the nearest.
    """
    if name not in suite.parts:
        raise UnknownNameError(f"part of the suite {suite.name!r}:", name, suite.parts)
    cells = tuple(cell for cell in suite.cells if spec_of(cell).key() in suite.parts[name])
    return Suite(f"{suite.name}-{name}", f"{suite.source}/{name}", f"{suite.summary}; part {name}", cells)


def _shipped() -> Any:
    return resources.files("zoobench") / "suites"


def _line(text: str) -> str:
    return " ".join(text.split())


def _cells(given: Mapping[str, Any], where: str) -> Iterator[RunSpec | Skip]:
    """The runs of one grid, environment by environment where each has a budget of its own."""
    for key, value in given.items():
        if value is None:
            raise UsageError(f"{where}, {key}: nothing, expected a value here or in `common`.")
    seeds = given["seeds"]
    grid = GridSpec(
        **{key: _at(f"{where}, {key}", _refs, given[key], kind) for key, kind in _AXES.items()},
        seeds=tuple(dict.fromkeys(seeds)) if isinstance(seeds, list) else tuple(range(seeds)),
        budget=Budget("substeps", 1),  # replaced below, as the fidelity is
        fidelity=Ref("draft"),
        frames=given["frames"],
    )
    budgets = _at(f"{where}, budget", _by_env, given["budget"], grid.envs, _budget)
    fidelities = _at(f"{where}, fidelity", _by_env, given["fidelity"], grid.envs, _fidelity)
    for env in grid.envs:
        yield from _at(where, expand, replace(grid, envs=(env,), budget=budgets[env], fidelity=fidelities[env]))


def _at(where: str, convert: Callable[..., Any], *values: Any) -> Any:
    """The result of `convert`; a UsageError of it is told with the place in the file."""
    try:
        return convert(*values)
    except UsageError as error:
        raise UsageError(f"{where}: {error}") from None


def _refs(names: str | list[str], kind: Kind) -> tuple[Ref, ...]:
    items = names if isinstance(names, list) else [names]
    return tuple(dict.fromkeys(pinned_published(kind, ref) for item in items for ref in parse_selector(item, kind)))


def _budget(amount: Any) -> Budget:
    return Budget.parse(str(amount))


def _fidelity(name: str) -> Ref:
    return parse_one(name, Kind.FIDELITY)


def _by_env(value: Any, envs: tuple[Ref, ...], convert: Callable[[Any], Any]) -> dict[Ref, Any]:
    """The setting of each environment; of a mapping, the first whose selector matches the environment in full.

    Raises:
        UsageError: none matches, or one stands for no environment that there is.
    """
    given = value if isinstance(value, dict) else {"*": value}
    settings = [(_env_selectors(text), convert(each)) for text, each in given.items()]
    found: dict[Ref, Any] = {}
    for env in envs:
        stated = registry.resolve(Kind.ENV, env)
        fitting = [setting for selectors, setting in settings if any(each.matches(stated) for each in selectors)]
        if not fitting:
            raise UsageError(f"nothing for {env.name}, expected a value for each environment, or for '*'.")
        found[env] = fitting[0]
    return found


def _env_selectors(text: str) -> tuple[Selector, ...]:
    """The selectors of a key, each of which stands for an environment; raises UsageError otherwise."""
    selectors = tuple(Selector.parse_all(text))
    for selector in selectors:
        refs = parse_selector(selector.text, Kind.ENV)
        if not selector.is_glob:  # of those that a glob fits, some may lack its parameters
            registry.resolve(Kind.ENV, refs[0])
    return selectors
