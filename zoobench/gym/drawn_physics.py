"""Parameters of the environment that are drawn anew for every episode."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.registry import Kind
from zoobench.spec import Ref, RunSpec, Scalar, Selector

Values = str | Sequence[float]
"""A range `(low, high)`, or values to choose from as the command line takes them: `"5e3|1e4|2e4"`."""


@dataclass(frozen=True)
class DrawnPhysics:
    """Distributions of parameters by their names: a range `(low, high)` or a list of values.

    A range of a whole parameter has its ends in it. Each parameter is drawn by itself, so that the order in which they
    are given changes nothing.
    """

    drawn: Mapping[str, tuple[Scalar, Scalar] | list[Scalar]]

    @classmethod
    def of(cls, env: Ref, physics: Mapping[str, Values]) -> Self:
        """The distributions that a user gives for an environment.

        Raises:
            UnknownNameError: the environment has no such parameter.
            UsageError: neither a range nor values, or the environment cannot have one of them.
        """
        if not isinstance(physics, Mapping):
            raise UsageError(
                f"physics={physics!r} was given, and a dictionary was expected. "
                "Give for example physics={'friction': (0.2, 0.8)}."
            )
        found = {name: _values(env, name, physics[name]) for name in sorted(physics)}
        for name, values in found.items():
            for value in values:
                registry.create(Kind.ENV, _with(env, {name: value}))
        return cls(found)

    @property
    def recurs(self) -> bool:
        """Whether the same physics are drawn again and again, as from a few values of each parameter."""
        return all(isinstance(values, list) for values in self.drawn.values())

    def draw(self, rng: np.random.Generator) -> dict[str, Scalar]:
        """The parameters of the next episode."""
        return {name: _draw(values, rng) for name, values in self.drawn.items()}


def with_physics(spec: RunSpec, drawn: Mapping[str, Scalar]) -> RunSpec:
    """The cell with these parameters of its environment."""
    return replace(spec, env=_with(spec.env, drawn))


def _with(env: Ref, values: Mapping[str, Scalar]) -> Ref:
    return registry.resolve(Kind.ENV, Ref(env.name, env.version, tuple(sorted({**env.kwargs, **values}.items()))))


def _values(env: Ref, name: str, given: Values) -> tuple[Scalar, Scalar] | list[Scalar]:
    """The range or the values of a parameter, in its type."""
    component = registry.get(Kind.ENV, env.name, env.version)
    registry.check_parameter(component, name)
    expected = component.parameters[name]
    if isinstance(given, str):
        chosen = [each.params[0][1] for each in Selector.parse_all(f"{env.name}[{name}={given}]")]
        return [float(each) if expected is float and _is_number(each) else each for each in chosen]
    if expected not in (int, float) or not _is_range(given):
        values = "true|false" if expected is bool else "|".join(map(str, given if _is_list(given) else [given]))
        raise UsageError(
            f"{name!r} cannot be drawn from {given!r}. Give a range as (low, high), of numbers, or values to choose "
            f"from as the text {values!r}."
        )
    low, high = given
    if expected is int and not (low == int(low) and high == int(high)):
        raise UsageError(f"{name!r} is whole and cannot be drawn from {given!r}. Give whole numbers.")
    return expected(low), expected(high)


def _is_list(given: Any) -> bool:
    return isinstance(given, list | tuple)


def _is_range(given: Any) -> bool:
    return _is_list(given) and len(given) == 2 and all(map(_is_number, given)) and given[0] < given[1]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool) and math.isfinite(value)


def _draw(values: tuple[Scalar, Scalar] | list[Scalar], rng: np.random.Generator) -> Scalar:
    if isinstance(values, list):
        return values[int(rng.integers(len(values)))]
    low, high = values
    if isinstance(low, int) and isinstance(high, int):
        return int(rng.integers(low, high, endpoint=True))
    return float(rng.uniform(float(low), float(high)))
