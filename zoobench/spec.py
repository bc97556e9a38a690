"""The specification of a run: immutable data with a canonical JSON form and a key.

A `RunSpec` holds everything that a result may depend on, and nothing else: no commit, machine, thread count or path.
"""

import hashlib
import json
import math
import re
import shlex
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, field, fields
from fnmatch import fnmatchcase
from itertools import product
from typing import Any, Literal, Self, TypeVar

from zoobench.errors import UnknownNameError, UsageError

Scalar = bool | int | float | str
BudgetKind = Literal["substeps", "episodes", "iterations", "seconds"]
BUDGET_KINDS: tuple[BudgetKind, ...] = ("substeps", "episodes", "iterations", "seconds")

FRAME_SECONDS = 0.008
"""Length of a control frame [s], as in SoftZoo."""

WALL_GAP = "wall_gap"
"""The reading of how near a robot came to a side of its arena [cells]."""

LEAST_WALL_GAP = 3.0
"""[cells] Below this gap the side has a part in the score."""


def is_at_wall(gap: float | None) -> bool:
    """Whether an episode with this smallest gap [cells] met a side of its arena; of None, an unknown one, not known."""
    return gap is not None and gap < LEAST_WALL_GAP


def standing(score: float, gap: float | None) -> tuple[bool, float]:
    """The key by which the best of several results is chosen: first those that are known to have kept away from walls.

    Of the others, at a wall or of an earlier zoobench that did not look, the score decides.
    """
    return gap is not None and not is_at_wall(gap), score


_LARGEST = 2**31 - 1
"""The largest whole number in a column of every supported database."""

_LARGEST_COUNT = 2**53
"""The largest amount that is counted without rounding."""

_REF = re.compile(r"^(?P<name>[a-z][a-z0-9]*(?:-[a-z0-9]+)*?)(?:-v(?P<version>[0-9]+))?(?:\[(?P<params>.*)\])?$")


def currency(kind: BudgetKind) -> BudgetKind:
    """The unit in which runs with a budget of this kind are compared by cost: substeps, unless it counts episodes."""
    return "episodes" if kind == "episodes" else "substeps"


def check_storable(name: str, number: int) -> None:
    """Raise a `UsageError` if a whole number of this name is too large for a column of a database."""
    if abs(number) > _LARGEST:
        raise UsageError(f"{name}={number} is too large for a database. Stay within {_LARGEST} either way.")


def canonical_json(value: Any) -> str:
    """The JSON text of a value with sorted keys, without spaces and NaN; equal values give equal text."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def _parse_scalar(text: str) -> Scalar:
    lowered = text.strip().lower()
    if lowered in ("true", "false"):
        return lowered == "true"
    for kind in (int, float):
        try:
            return kind(lowered)
        except ValueError:
            continue
    return text.strip()


@dataclass(frozen=True)
class Ref:
    """A reference to a registered component with version and parameters, written `diffphysics-v1[lr=0.1]`.

    Version 0 is the newest and is replaced when the registry resolves the reference.
    """

    name: str
    version: int = 0
    params: tuple[tuple[str, Scalar], ...] = ()

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read `name`, `name-v2` or `name[key=value,key=value]`; keys may be written with - for _, as names are.

        Raises:
            UsageError: the text has another form, gives a key twice, or asks for version 0.
        """
        match = _REF.match(text.strip())
        if match is None:
            raise UsageError(f"Cannot read {text!r} as a component. Write name, name-v1 or name-v1[key=value,...].")
        if match["version"] and not int(match["version"]):
            raise UsageError(f"{text!r} asks for version 0, and versions count from 1. Leave it out for the newest.")
        params: dict[str, Scalar] = {}
        for item in filter(None, split_outside_brackets(match["params"] or "")):
            key, separator, value = item.partition("=")
            if not separator or not key.strip() or not value.strip():
                raise UsageError(f"Cannot read the parameter {item!r} of {text!r}. Write key=value.")
            key = key.strip().replace("-", "_")
            if key in params:
                raise UsageError(f"{key!r} is given twice in {text!r}, and only the last would count. Give it once.")
            params[key] = _parse_scalar(value)
        return cls(match["name"], int(match["version"] or 0), tuple(sorted(params.items())))

    @property
    def kwargs(self) -> dict[str, Scalar]:
        """The parameters as keyword arguments."""
        return dict(self.params)

    def with_defaults(self, **defaults: Scalar) -> Self:
        """This reference with these values for parameters that it does not give."""
        return type(self)(self.name, self.version, tuple(sorted({**defaults, **self.kwargs}.items())))

    def __str__(self) -> str:
        version = f"-v{self.version}" if self.version else ""
        params = ",".join(f"{key}={value}" for key, value in self.params)
        return f"{self.name}{version}" + (f"[{params}]" if params else "")


def split_outside_brackets(text: str, separator: str = ",") -> list[str]:
    """The parts of a text between separators that stand in no brackets: a setting may name a solution with some."""
    parts, depth = [""], 0
    for sign in text:
        depth += (sign == "[") - (sign == "]")
        if sign == separator and depth <= 0:
            parts.append("")
        else:
            parts[-1] += sign
    return parts


def _alternatives(text: str) -> list[str]:
    """The selectors that one with several values of a parameter stands for."""
    head, bracket, rest = text.partition("[")
    if "|" not in rest or not rest.endswith("]"):
        return [text]
    choices = []
    for item in split_outside_brackets(rest[:-1]):
        key, sign, values = item.partition("=")
        choices.append([f"{key}{sign}{value}" for value in values.split("|")])
    return [f"{head}{bracket}{','.join(chosen)}]" for chosen in product(*choices)]


@dataclass(frozen=True)
class Selector:
    """A component by name or glob, with the version (0: any) and the parameters that it must have: `des*[depth=2]`.

    Attributes:
        text: the selector as it was typed.
    """

    text: str
    name: str
    version: int = 0
    params: tuple[tuple[str, Scalar], ...] = ()

    @classmethod
    def parse_all(cls, text: str) -> list[Self]:
        """Read selectors that are separated by commas; commas in brackets belong to the brackets.

        Values of a parameter that are separated by `|` stand for a selector each: `ground[friction=0.2|0.5]` for two,
        and two such parameters for all combinations.

        Raises:
            UsageError: one of them has another shape.
        """
        return [cls._parse(each) for item in split_outside_brackets(text) for each in _alternatives(item.strip())]

    @classmethod
    def _parse(cls, text: str) -> Self:
        head, bracket, rest = text.partition("[")
        if "]" in rest[:-1] and not rest.endswith("]"):  # signs to choose from within a glob, as in `[ds]*`
            head, bracket, rest = text, "", ""
        is_glob = any(sign in head for sign in "*?[")
        ref = Ref.parse(f"any{bracket}{rest}" if is_glob else text)
        return cls(text, head if is_glob else ref.name, ref.version, ref.params)

    @property
    def is_glob(self) -> bool:
        """Whether it may stand for several names."""
        return any(sign in self.name for sign in "*?[")

    def matches(self, ref: Ref) -> bool:
        """Whether a component with all parameters stated is one of those that are selected."""
        return (
            fnmatchcase(ref.name, self.name)
            and self.version in (0, ref.version)
            and all(ref.kwargs.get(key) == value for key, value in self.params)
        )


def matching(pattern: str, names: Iterable[str], noun: str) -> list[str]:
    """The names that a name or glob fits, in their order.

    Args:
        noun: for the named thing, in a message.

    Raises:
        UnknownNameError: none fits; suggests the nearest.
    """
    known = list(names)
    found = [name for name in known if fnmatchcase(name, pattern)]
    if not found:
        raise UnknownNameError(noun, pattern, known)
    return found


@dataclass(frozen=True)
class Budget:
    """The budget of a method; `substeps` are forward and backward substeps together."""

    kind: BudgetKind
    amount: float

    def __post_init__(self) -> None:
        if self.kind not in BUDGET_KINDS:
            raise UsageError(f"Unknown budget kind {self.kind!r}. Choose one of {', '.join(BUDGET_KINDS)}.")
        if not self.amount > 0:
            raise UsageError(f"A budget of {self} allows nothing. Give a positive amount.")
        if not math.isfinite(self.amount):
            raise UsageError(f"A budget of {self} never ends. Give a finite amount.")

    @classmethod
    def parse(cls, text: str) -> Self:
        """Read `200000`, `200000 substeps`, `50episodes` or `60 seconds`; a bare number means substeps.

        Raises:
            UsageError: the amount is not positive, too large or not whole where it must be, or the kind is unknown.
        """
        match = re.match(r"^\s*([-+0-9.eE_]+)\s*([a-z]*)\s*$", text)
        try:
            amount = float(match[1]) if match else float("nan")
        except ValueError:
            amount = float("nan")
        if match is None or amount != amount:
            raise UsageError(f"Cannot read {text!r} as a budget. Write for example 200000 or '60 seconds'.")
        budget = cls(match[2] or "substeps", amount)  # type: ignore[arg-type]  # checked in __post_init__
        if budget.kind != "seconds" and not amount.is_integer():
            raise UsageError(
                f"A budget of {text!r} cannot be met: {budget.kind} are counted whole. Give a whole number."
            )
        if amount > _LARGEST_COUNT:
            raise UsageError(f"A budget of {text!r} cannot be counted. Give at most {_LARGEST_COUNT}.")
        return budget

    def __str__(self) -> str:
        amount = float(self.amount)
        return f"{int(amount) if amount.is_integer() else amount} {self.kind}"


AXES = ("env", "task", "design", "controller", "method", "fidelity")
"""The fields of a `RunSpec` that refer to components."""


@dataclass(frozen=True)
class RunSpec:
    """One cell of the benchmark with a seed; `frames` is the length of an episode in control frames."""

    env: Ref
    task: Ref
    design: Ref
    controller: Ref
    method: Ref
    seed: int
    budget: Budget
    fidelity: Ref
    frames: int
    schema: int = field(default=1)

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise UsageError(f"The seed {self.seed} is negative. Give a whole number from 0 upwards.")
        if self.frames < 1:
            raise UsageError(f"An episode of {self.frames} frames is empty. Give at least 1.")
        for name in ("seed", "frames"):
            check_storable(name, getattr(self, name))

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON data, the inverse of `from_dict`."""
        return {item.name: plain(getattr(self, item.name)) for item in fields(self)}

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Rebuild a spec from `to_dict` data."""
        refs = {
            name: Ref(data[name]["name"], data[name]["version"], tuple(sorted(data[name]["params"].items())))
            for name in AXES
        }
        budget = Budget(data["budget"]["kind"], data["budget"]["amount"])
        return cls(**refs, seed=data["seed"], budget=budget, frames=data["frames"], schema=data["schema"])

    def key(self) -> str:
        """sha256 of the canonical JSON: the identity of the run in every database."""
        return hashlib.sha256(canonical_json(self.to_dict()).encode()).hexdigest()

    def cell(self) -> tuple[str, ...]:
        """Everything but the seed, by which tables group runs."""
        return (*(str(getattr(self, axis)) for axis in AXES), str(self.frames), str(self.budget))

    def __str__(self) -> str:
        names = (self.env, self.task, self.design, self.method)
        return " x ".join(str(Ref(ref.name)) for ref in names) + f" seed {self.seed}"


T = TypeVar("T")


@dataclass(frozen=True)
class RunSelection:
    """Runs by their components: selectors with commas for each axis, an empty text for all of it."""

    env: str = ""
    task: str = ""
    design: str = ""
    controller: str = ""
    method: str = ""
    fidelity: str = ""

    def options(self) -> list[str]:
        """The command line options that make this selection."""
        return [part for axis in AXES if (text := getattr(self, axis)) for part in (f"--{axis}", text)]

    def among(self, items: Iterable[T], spec_of: Callable[[T], RunSpec], place: str, hint: str = "") -> list[T]:
        """The items whose runs are selected on every axis, in their order.

        Args:
            place: where the items are, for messages: `in the database`.
            hint: an addition to the message.

        Raises:
            UnknownNameError: a name or glob that fits no item; suggests the nearest.
            UsageError: a version or parameters that no item has, or nothing is left.
        """
        known = list(items)
        left = known
        for axis in AXES if known else ():
            if getattr(self, axis):
                wanted = self.wanted(axis, {getattr(spec_of(item), axis) for item in known}, place, hint)
                left = [item for item in left if getattr(spec_of(item), axis) in wanted]
        if known and not left:
            raise self.nothing_left(place)
        return left

    def wanted(self, axis: str, refs: Collection[Ref], place: str, hint: str = "") -> set[Ref]:
        """Those of the references of an axis that are selected; raises as `among`."""
        selectors = Selector.parse_all(getattr(self, axis))
        return {ref for each in selectors for ref in _selected(each, refs, axis, place, hint)}

    def nothing_left(self, place: str) -> UsageError:
        """The error where every axis finds something and no run has all of it."""
        options = ", ".join(option for option in self.options()[::2])
        return UsageError(f"No run {place} is all that {options} ask for. Leave one of them out.")


def _selected(selector: Selector, refs: Iterable[Ref], axis: str, place: str, hint: str) -> list[Ref]:
    found = [ref for ref in refs if selector.matches(ref)]
    if not found:
        names = matching(selector.name, sorted({ref.name for ref in refs}), f"{axis} {place}:")
        others = ", ".join(sorted(str(ref) for ref in refs if ref.name in names))
        raise UsageError(f"No {axis} {place} is {selector.text!r}. {hint}There are {others}.")
    return found


def on_gpu(spec: RunSpec) -> bool:
    """Whether the run is simulated on a GPU."""
    return spec.fidelity.kwargs.get("device") == "cuda"


def repeat_command(spec: RunSpec, *others: RunSpec) -> str:
    """The command that makes this run again in another database, with others that differ in method or seed only."""
    specs = (spec, *others)
    words = ["zoobench", "run"]
    for axis in AXES:
        words += [f"--{axis}", ",".join(dict.fromkeys(str(getattr(each, axis)) for each in specs))]
    words += ["--frames", str(spec.frames), "--budget", str(spec.budget)]
    seeds = sorted({each.seed for each in specs})
    # A bare number is a count of seeds, so one seed alone is written as a list.
    words += ["--seeds", ",".join(map(str, seeds)) if len(seeds) > 1 else f"{seeds[0]},"]
    return shlex.join(words)


def plain(value: Any) -> Any:
    """A field of a `RunSpec` as plain JSON data."""
    if isinstance(value, Ref):
        return {"name": value.name, "version": value.version, "params": value.kwargs}
    if isinstance(value, Budget):
        return {"kind": value.kind, "amount": float(value.amount)}
    return value
