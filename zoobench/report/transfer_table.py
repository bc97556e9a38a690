"""The transfer matrix: scores of solutions in the environments where they were found and in others."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from zoobench.report.labels import in_order, labels
from zoobench.report.listing import Listing, Measured, listing_by
from zoobench.report.provisional import marked
from zoobench.report.run_results import SMOKE
from zoobench.report.statistics import Interval, t_interval
from zoobench.spec import Budget, Ref, RunSpec
from zoobench.tasks.quantities import Quantity, heading, quantity_of

Document = Mapping[str, Any]
"""A row of the study."""


class Setting(NamedTuple):
    """The settings of a row of the matrix: those of its episodes, and those in which their solutions were found."""

    task: Ref
    fidelity: Ref
    design: Ref
    method: Ref
    found_in: Ref
    frames: int
    found_for: Ref
    found_at: Ref
    controller: Ref | None
    budget: Budget | None

    def is_home(self, env: Ref) -> bool:
        """Whether the solutions were found in this environment, for this task and at this fidelity."""
        return (env, self.task, self.fidelity) == (self.found_in, self.found_for, self.found_at)


class Tried(NamedTuple):
    """The episodes of a setting in one environment: their scores, and how many runs have none."""

    setting: Setting
    env: Ref
    interval: Interval | None
    lost: int
    unit: str

    @property
    def quantity(self) -> Quantity:
        """The quantity of the scores."""
        return quantity_of(self.setting.task, self.unit)


_COLUMNS: dict[str, Callable[[Tried], Any]] = {
    "task": lambda each: str(each.setting.task),
    "fidelity": lambda each: str(each.setting.fidelity),
    "frames": lambda each: each.setting.frames,
    "design": lambda each: str(each.setting.design),
    "controller": lambda each: each.setting.controller and str(each.setting.controller),
    "method": lambda each: str(each.setting.method),
    "budget_kind": lambda each: each.setting.budget and each.setting.budget.kind,
    "budget_amount": lambda each: each.setting.budget and each.setting.budget.amount,
    "found_in": lambda each: str(each.setting.found_in),
    "found_for": lambda each: str(each.setting.found_for),
    "found_at": lambda each: str(each.setting.found_at),
    "env": lambda each: str(each.env),
    "mean": lambda each: each.interval and each.interval.mean,
    "low": lambda each: each.interval and each.interval.low,
    "high": lambda each: each.interval and each.interval.high,
    "unit": lambda each: each.unit,
    "n": lambda each: each.interval.count if each.interval else 0,
    "diverged": lambda each: each.lost,
}

_USUAL = ("task", "fidelity", "design", "method", "found_in", "frames")
_TELLING = ("found_for", "found_at", "controller", "budget")
"""Settings that are columns only where they tell rows apart."""


def newest(documents: Iterable[Document]) -> list[Document]:
    """The last row of every run, place and episode length."""
    last = {tuple(row[name] for name in ("env", "task", "fidelity", "frames", "run")): row for row in documents}
    return [last[key] for key in sorted(last, key=str)]


def tried(documents: Iterable[Document], specs: Mapping[int, RunSpec]) -> list[Tried]:
    """The episodes by setting and environment, in order; smoke runs are left out.

    `specs` are those of the runs by number, as far as they are known.
    """
    groups: dict[tuple[Setting, Ref], list[Document]] = defaultdict(list)
    for row in newest(documents):
        setting = _setting(row, specs.get(row["run"]))
        if SMOKE not in (setting.fidelity.name, setting.found_at.name):
            groups[setting, Ref.parse(row["env"])].append(row)
    found = []
    for (setting, env), rows in groups.items():
        scores = [row["score"] for row in rows if row["score"] is not None]
        found.append(Tried(setting, env, t_interval(scores), len(rows) - len(scores), rows[0]["unit"]))
    return sorted(found, key=lambda each: (_order(each.setting), in_order(each.env)))


def transfer_cells(found: Iterable[Tried]) -> Listing:
    """The matrix for programs: mean and 95 % interval of the scores of `n` runs; `diverged` have none."""
    return listing_by(_COLUMNS, found)


def transfer_matrices(found: Sequence[Tried]) -> list[Listing]:
    """The matrix for people, one for each quantity; empty where nothing was evaluated.

    A row is a task, fidelity, design, method and home, a column an environment in which it was tried. Runs that were
    found for another task, at another fidelity, with another controller or budget have rows of their own, and a column
    that says so. A cell holds the mean score over runs with half of its 95 % interval; the place where they were found
    is bold.
    """
    quantities = sorted({each.quantity for each in found})
    return [_matrix([each for each in found if each.quantity == quantity], quantity) for quantity in quantities]


def _matrix(found: Sequence[Tried], quantity: Quantity) -> Listing:
    settings = list(dict.fromkeys(each.setting for each in found))
    envs = sorted({each.env for each in found}, key=in_order)
    telling = [name for name in _TELLING if len({getattr(setting, name) for setting in settings}) > 1]
    shown = (*_USUAL, *telling)
    names = {name: _names(name, settings, envs) for name in shown}
    cells = {(each.setting, each.env): each for each in found}
    rows = [
        (
            *(names[name].get(value, value) for name in shown for value in [getattr(setting, name)]),
            *(_estimate(cells.get((setting, env)), quantity) for env in envs),
        )
        for setting in settings
    ]
    bold = {
        (number, len(shown) + place)
        for number, setting in enumerate(settings)
        for place, env in enumerate(envs)
        if setting.is_home(env)
    }
    env_names = _names("found_in", settings, envs)
    unit = f" [{quantity.unit}]" if quantity.unit else ""
    columns = (*shown, *(f"{env_names[env]}{unit}" for env in envs))
    return Listing(columns, tuple(rows), frozenset(bold), title=quantity.title)


def _names(name: str, settings: Iterable[Setting], envs: Iterable[Ref]) -> Mapping[Any, str]:
    """The labels of the components of a column; empty for a column of numbers."""
    refs = {value for setting in settings if isinstance(value := getattr(setting, name), Ref)}
    return marked(labels(refs | set(envs))) if name == "found_in" else labels(refs)


def _setting(row: Document, spec: RunSpec | None) -> Setting:
    home = [Ref.parse(text) for text in row["home"]]
    here = [Ref.parse(row[name]) for name in ("task", "fidelity", "design", "method")]
    own = (None, None) if spec is None else (spec.controller, spec.budget)
    task, fidelity, design, method = here
    found_in, found_for, found_at = home
    return Setting(task, fidelity, design, method, found_in, row["frames"], found_for, found_at, *own)


def _order(setting: Setting) -> list[object]:
    """The key by which settings are sorted."""
    return [in_order(value) for value in setting if value is not None]


def _estimate(each: Tried | None, quantity: Quantity) -> Measured | None:
    if each is None:
        return None
    lost = [f"{each.lost} diverged"] if each.lost else []
    if each.interval is None:
        return Measured(None, notes=tuple(lost))
    notes = (f"n={each.interval.count}", *lost)
    return Measured(each.interval.mean, each.interval.low, each.interval.high, notes).scaled(quantity.sign)


def episode_listing(documents: Sequence[Document]) -> Listing:
    """Episodes as they were evaluated, for programs; `score` is None where there is none, as `reason` says."""
    homes = ("found_in", "found_for", "found_at")
    columns = (
        "run", "seed", "design", "method", *homes, "env", "task", "fidelity", "frames", "score", "unit", "reason"
    )  # fmt: skip
    rows = [{**row, **dict(zip(homes, row["home"], strict=True))} for row in documents]
    return Listing(columns, tuple(tuple(row[name] for name in columns) for row in rows))


def episode_overview(documents: Sequence[Document]) -> Listing:
    """The same for people."""
    places = {name: [Ref.parse(row[name]) for row in documents] for name in ("env", "task", "fidelity")}
    homes = [Ref.parse(row["home"][0]) for row in documents]
    names = {name: labels(refs) for name, refs in places.items()}
    envs = marked(labels([*homes, *places["env"]]))
    quantities = [quantity_of(task, row["unit"]) for task, row in zip(places["task"], documents, strict=True)]
    rows = [
        (
            row["run"], envs[home], envs[places["env"][number]], names["task"][places["task"][number]],
            names["fidelity"][places["fidelity"][number]],
            None if row["score"] is None else quantity.sign * row["score"], quantity.unit_text, row["reason"] or None,
        )
        for number, (row, home, quantity) in enumerate(zip(documents, homes, quantities, strict=True))
    ]  # fmt: skip
    columns = ("run", "found_in", "env", "task", "fidelity", heading(quantities), "unit", "reason")
    return Listing(columns, tuple(rows))
