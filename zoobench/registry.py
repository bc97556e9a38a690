"""The registry of components: environments, tasks, designs, controllers, methods and fidelities.

A component is a class or function with the decorator `@register(Kind.TASK, "turning", version=1)`, in a module of the
package `zoobench.<kind>` or in a module that an installed plug-in names as an entry point of the group
`zoobench.<kind>`. The modules of a kind are imported at the first query.

Parameters that several components share are written once, as a group: a frozen dataclass that documents its fields. A
factory takes the group as one parameter, `physics: Physics = Physics()`, whose default holds the component's defaults;
users see and set the fields as parameters of the component.
"""

import importlib
import importlib.metadata
import inspect
import math
import pkgutil
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import StrEnum
from functools import cache, lru_cache
from importlib.util import find_spec
from typing import Any, Literal, NamedTuple, TypeVar, cast, get_args, get_origin, get_type_hints

from zoobench.errors import UnknownNameError, UsageError
from zoobench.inputs import InputFile, StoredRun, checked_run_name, pin
from zoobench.spec import AXES, Ref, Scalar

COMPOSED = "composed"
"""Tag of a component that is made of others and is nothing without settings."""

FOR_STUDIES = "study"
"""Tag of a component that a study uses: globs leave it out."""

_NAME = re.compile(r"[a-z][a-z0-9]*(-[a-z0-9]+)*")


class Kind(StrEnum):
    """The kinds of components, one for each axis of the benchmark; the value is the name of the package."""

    ENV = "envs"
    TASK = "tasks"
    DESIGN = "designs"
    CONTROLLER = "controllers"
    METHOD = "methods"
    FIDELITY = "fidelities"

    @property
    def noun(self) -> str:
        """The word for a component of this kind in messages."""
        return _NOUNS[self]


KINDS = dict(zip(AXES, Kind, strict=True))
"""The kind of component on each axis of a spec."""

_NOUNS = {
    Kind.ENV: "environment",
    Kind.TASK: "task",
    Kind.DESIGN: "design",
    Kind.CONTROLLER: "controller",
    Kind.METHOD: "method",
    Kind.FIDELITY: "fidelity",
}


@dataclass(frozen=True)
class Component:
    """One registered version of one component.

    Attributes:
        factory: called with the parameters of a `Ref` as keyword arguments, those of a group as one dataclass.
        summary: the first line of the factory's docstring.
        defaults: of the parameters that have one.
        parameters: the annotated type of every parameter.
        groups: the dataclasses with the defaults of parameters that components share, by the factory's parameter.
        added: parameters that earlier versions of the package did not have, with the values that they left them; see
            `register`.
        provisional: why its scores are provisional, in a sentence; empty if they are not.
        unless: parameters with which they are not; None for none.
        extra: of zoobench without which it cannot run; empty for none.
    """

    kind: Kind
    name: str
    version: int
    factory: Callable[..., Any]
    summary: str
    tags: frozenset[str]
    defaults: Mapping[str, Scalar]
    parameters: Mapping[str, Any]
    groups: Mapping[str, Any]
    added: Mapping[str, Scalar]
    provisional: str = ""
    unless: Mapping[str, Scalar] | None = None
    extra: str = ""

    @property
    def lacking(self) -> str:
        """Why it cannot run here, with the remedy: a library of its extra is not installed. Empty if it can."""
        missing = [name for name in _LIBRARIES.get(self.extra, ()) if find_spec(name) is None]
        if not missing:
            return ""
        return (
            f"The {self.kind.noun} {self.name!r} needs {' and '.join(missing)}, which is not installed. "
            f"Try: pip install 'zoobench[{self.extra}]'."
        )

    @property
    def required(self) -> frozenset[str]:
        """The parameters without a default, which a reference must give."""
        return frozenset(self.parameters) - frozenset(self.defaults)

    @property
    def needs_object(self) -> bool:
        """Whether it is a task that reads an object, so that its environment must have one."""
        return bool(getattr(self.factory, "needs_object", False))

    @property
    def usual_settings(self) -> Mapping[str, Scalar]:
        """Of a task, those of an environment in which it makes sense; empty where a bare one does."""
        return getattr(self.factory, "usual_settings", {})

    @property
    def needs_settings(self) -> bool:
        """Whether the bare name is nothing that can be run: a parameter is required, or one of several (`COMPOSED`)."""
        return bool(self.required) or COMPOSED in self.tags

    @property
    def description(self) -> str:
        """The docstrings of the factory and of the groups."""
        return "\n\n".join(inspect.getdoc(item) or "" for item in (self.factory, *map(type, self.groups.values())))

    def stated(self, ref: Ref) -> dict[str, Scalar]:
        """All parameters of a reference: its own, the added ones that one with a version leaves out, and defaults."""
        return {**self.defaults, **(self.added if ref.version else {}), **ref.kwargs}

    def make(self, ref: Ref) -> Any:
        """Call the factory with the parameters of a reference; a group's own defaults are those of the component."""
        values = self.stated(ref)
        arguments: dict[str, Any] = dict(values)
        for name, group in self.groups.items():
            own = {item.name: arguments.pop(item.name) for item in fields(group) if item.name in values}
            arguments[name] = replace(group, **own)
        return self.factory(**arguments)

    @property
    def ref(self) -> Ref:
        """The reference to this component with all defaults."""
        return self.ref_with({})

    def ref_with(self, given: Mapping[str, Scalar]) -> Ref:
        """The reference that states all parameters, those not given by their default, but no added one at its default.

        So the key of a run is that of the package's versions without the parameter. One whose default has changed is
        stated always.
        """
        stated = {**self.defaults, **given}
        left_out = {key for key, was in self.added.items() if stated[key] == was == self.defaults[key]}
        return Ref(self.name, self.version, tuple(sorted(item for item in stated.items() if item[0] not in left_out)))


@dataclass(frozen=True)
class PluginFailure:
    """An installed plug-in that could not be loaded; shown by `zoobench doctor`."""

    group: str
    entry_point: str
    reason: str


_components: dict[Kind, dict[str, dict[int, Component]]] = {kind: {} for kind in Kind}
_discovered: set[Kind] = set()
_failures: list[PluginFailure] = []

_TEXTS: Mapping[Any, Callable[[str], str]] = {str: str, StoredRun: checked_run_name}
"""Types of text parameters other than files, with the function that turns input into a setting."""

_TYPE_NOUNS: Mapping[Any, str] = {bool: "true or false", int: "a whole number", float: "a finite number"}
"""Types of other parameters, in words."""

_LIBRARIES: Mapping[str, tuple[str, ...]] = {"ppo": ("gymnasium", "stable_baselines3"), "qd": ("ribs",)}
"""The libraries of the extras that components need."""

_F = TypeVar("_F", bound=Callable[..., Any])


def register(
    kind: Kind,
    name: str,
    *,
    version: int = 1,
    tags: tuple[str, ...] = (),
    added: tuple[str, ...] = (),
    was: Mapping[str, Scalar] | None = None,
    provisional: str = "",
    unless: Mapping[str, Scalar] | None = None,
    extra: str = "",
) -> Callable[[_F], _F]:
    """Decorate a class or function as a component, selectable as `name` or `name[parameter=value]`.

    Increase `version` whenever the component's numbers change: results of different versions are never mixed. Name in
    `added` the parameters, or groups of them, that it did not have when this version was first published, with defaults
    that leave its numbers as they were: while they have their default, references and keys of runs are those without
    them. `was` names added parameters with another default by now, with the values that leave the numbers as they were:
    references with a version that leave them out, as those of stored runs, have those.
    Parameters that name a stored run are always added ones. `provisional` says in a sentence why scores are not
    yet what they are called, but for those with the parameters `unless`; every report of them repeats it. `extra` is
    the one of zoobench without whose libraries its runs are skipped.

    Raises:
        UsageError: the name is taken or malformed, a parameter has no type or a default that is not a bool, int,
            float, str or group, two have one name, or an added one is none of the parameters with a default.
    """
    check_name(name)
    if version < 1:
        raise UsageError(f"Cannot register {name!r} version {version}. Versions count from 1.")

    def decorate(factory: _F) -> _F:
        known = _components[kind].get(name, {})
        if version in known:
            other = known[version].factory
            raise UsageError(
                f"The {kind.noun} {name!r} version {version} is registered already, by {other.__module__}."
                f"{other.__qualname__}. Choose another name or increase the version."
            )
        component = _describe(kind, name, version, factory, frozenset(tags), frozenset(added), was or {})
        _components[kind].setdefault(name, {})[version] = replace(
            component, provisional=provisional, unless=unless, extra=extra
        )
        return factory

    return decorate


def check_name(name: str) -> None:
    """Check that a component may have this name.

    Raises:
        UsageError: it is not in kebab-case.
    """
    if not _NAME.fullmatch(name):
        raise UsageError(f"A component cannot be named {name!r}. Use kebab-case, as in wet-rock.")


def names(kind: Kind) -> list[str]:
    """The names of a kind, sorted."""
    _discover(kind)
    return sorted(_components[kind])


def get(kind: Kind, name: str, version: int = 0) -> Component:
    """The component with this name; version 0 is the newest.

    Raises:
        UnknownNameError: no component has this name.
        UsageError: the component does not have this version.
    """
    _discover(kind)
    versions = _components[kind].get(name)
    if not versions:
        raise UnknownNameError(kind.noun, name, _components[kind])
    if version == 0:
        return versions[max(versions)]
    if version not in versions:
        known = ", ".join(f"{name}-v{known}" for known in sorted(versions))
        raise UsageError(f"The {kind.noun} {name!r} has no version {version}. Known: {known}.")
    return versions[version]


def _this_or_next(kind: Kind, ref: Ref) -> Component | None:
    """The component of a reference, the newest without a version; where its version is gone, the next one that is not.

    None if there is none.
    """
    _discover(kind)
    versions = _components[kind].get(ref.name, {})
    later = [version for version in versions if version >= ref.version]
    return versions[min(later) if ref.version else max(later)] if later else None


def short(kind: Kind, ref: Ref) -> str:
    """A component's name with those parameters that are not the default ones, see `unusual`."""
    return str(Ref(ref.name, 0, tuple(unusual(kind, ref).items())))


def unusual(kind: Kind, ref: Ref) -> dict[str, Scalar]:
    """Those parameters of a reference that are not the component's default ones, sorted.

    Of a version that is no longer registered these are only added ones, and what one was whose default is another by
    now.
    """
    component = _this_or_next(kind, ref)
    if component is None:
        return {}
    stated = component.stated(ref)
    known = stated if ref.version in (0, component.version) else component.added
    return {key: stated[key] for key in sorted(known) if component.defaults.get(key) != stated[key]}


def resolve(kind: Kind, ref: Ref) -> Ref:
    """The same reference with version and all parameters but added ones at their default, as it enters a run's key.

    Raises:
        UnknownNameError: unknown name or parameter.
        UsageError: unknown version, a value of the wrong type, or a required parameter missing.
    """
    component = get(kind, ref.name, ref.version)
    given = component.stated(ref) | {key: _coerce(component, key, value) for key, value in ref.params}
    missing = [key for key in component.parameters if key not in given]
    if missing:
        raise UsageError(f"{kind.noun.capitalize()} {ref.name!r} needs a value: write {ref.name}[{missing[0]}=...].")
    return component.ref_with(given)


def caveat(kind: Kind, ref: Ref) -> str:
    """Why the scores of a component are provisional; empty if they are not, or if it is of a plug-in that is gone.

    A version that is no longer registered, as of runs made long ago, is what the next one that is says.
    """
    component = _this_or_next(kind, ref)
    if component is None or (component.unless and component.unless.items() <= component.stated(ref).items()):
        return ""
    return component.provisional


def create(kind: Kind, ref: Ref) -> Any:
    """Create the component with the parameters of the reference.

    The same reference to a design gives the same object for a while: it is immutable, and to measure it takes long.

    Raises:
        UnknownNameError, UsageError: as `resolve`.
    """
    resolved = resolve(kind, ref)
    component = get(kind, resolved.name, resolved.version)
    return _design(component.factory, resolved) if kind is Kind.DESIGN else component.make(resolved)


@lru_cache(maxsize=64)
def _design(factory: Callable[..., Any], ref: Ref) -> Any:
    """A design; the factory is part of the key, as a name may be registered anew."""
    return get(Kind.DESIGN, ref.name, ref.version).make(ref)


def failures() -> list[PluginFailure]:
    """The installed plug-ins of all kinds that could not be loaded."""
    for kind in Kind:
        _discover(kind)
    return list(_failures)


def _describe(
    kind: Kind, name: str, version: int, factory: Callable[..., Any], tags: frozenset[str], added: frozenset[str],
    was: Mapping[str, Scalar],
) -> Component:  # fmt: skip
    defaults: dict[str, Scalar] = {}
    parameters: dict[str, Any] = {}
    groups: dict[str, Any] = {}
    later = {*added, *was}
    for key, expected, default, group in _parameters(kind, name, factory):
        if key in parameters:
            raise UsageError(f"The {kind.noun} {name!r} has two parameters {key!r}. Rename one of them.")
        parameters[key] = expected
        if group in added:
            later.add(key)
        if group:
            groups[group] = inspect.signature(factory).parameters[group].default
        if default is inspect.Parameter.empty:
            continue
        if not isinstance(default, bool | int | float | str):
            raise UsageError(f"The default of {key!r} of {name!r} is not a bool, int, float or str.")
        defaults[key] = float(default) if expected is float else default
        if expected is StoredRun:
            later.add(key)
    later -= groups.keys()
    if unknown := sorted(later - defaults.keys()):
        raise UsageError(f"{name!r} has no parameter {unknown[0]!r} with a default that could be an added one.")
    summary = (inspect.getdoc(factory) or "").partition("\n")[0]
    left_out = {key: was.get(key, defaults[key]) for key in sorted(later)}
    return Component(kind, name, version, factory, summary, tags, defaults, parameters, groups, left_out)


class _Parameter(NamedTuple):
    """A parameter as it is declared; `group` is the factory's parameter that holds it, empty for its own."""

    name: str
    expected: Any
    default: Any
    group: str


def _parameters(kind: Kind, name: str, factory: Callable[..., Any]) -> Iterator[_Parameter]:
    """The parameters of a factory, with the fields of a group in its place."""
    for key, parameter in inspect.signature(factory, eval_str=True).parameters.items():
        if parameter.kind not in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD):
            raise UsageError(f"The {kind.noun} {name!r} takes *{key}. Name every parameter and annotate its type.")
        expected, default = parameter.annotation, parameter.default
        if expected is parameter.empty:
            raise UsageError(f"The parameter {key!r} of {name!r} has no type. Annotate it.")
        if isinstance(expected, type) and is_dataclass(expected) and isinstance(default, expected):
            hints = get_type_hints(expected)
            yield from (
                _Parameter(item.name, hints[item.name], getattr(default, item.name), key) for item in fields(expected)
            )
        else:
            yield _Parameter(key, expected, default, "")


def _coerce(component: Component, key: str, value: Scalar) -> Scalar:
    """The value in the parameter's type, so that `lr=1` and `lr=1.0` are the same run."""
    check_parameter(component, key)
    expected = component.parameters[key]
    if get_origin(expected) is Literal:
        for choice in get_args(expected):
            if choice == value:
                return cast("Scalar", choice)
        choices = ", ".join(str(choice) for choice in get_args(expected))
        raise UsageError(f"{component.name}[{key}={value}] is not offered. Choose one of {choices}.")
    if expected in _TEXTS:
        return _TEXTS[expected](str(value))
    if names_file(expected):
        return pin(str(value), expected.endings)
    if isinstance(value, bool):
        if expected is bool:
            return value
    elif isinstance(value, int | float) and math.isfinite(value):
        if expected is float:
            return float(value)
        if expected is int and value == int(value):
            return int(value)
    noun = _TYPE_NOUNS.get(expected, str(expected))
    raise UsageError(f"{component.name}[{key}={value}]: {key!r} must be {noun}.")


def check_parameter(component: Component, name: str) -> None:
    """Check that a component has a parameter of this name.

    Raises:
        UsageError: it has none; names the others of its kind that have one, or its similar parameters.
    """
    if name in component.parameters:
        return
    newest = (get(component.kind, other) for other in names(component.kind))
    if having := [other.name for other in newest if name in other.parameters]:
        raise UsageError(
            f"The {component.kind.noun} {component.name!r} has no parameter {name!r}. Leave it out, or choose one of "
            f"those that have it: {', '.join(having)}."
        )
    raise UnknownNameError(f"parameter of {component.name!r}:", name, component.parameters)


def names_file(expected: Any) -> bool:
    """Whether the annotation of a parameter says that it names a file."""
    return isinstance(expected, type) and issubclass(expected, InputFile)


def has_plugins() -> bool:
    """Whether any installed package offers components."""
    return not _entry_points().groups.isdisjoint(f"zoobench.{kind}" for kind in Kind)


def distributions() -> dict[str, str]:
    """The names of the installed packages that offer components, by the top-level module of an entry point."""
    points = (point for kind in Kind for point in _entry_points().select(group=f"zoobench.{kind}"))
    return {point.module.partition(".")[0]: point.dist.name for point in points if point.dist is not None}


@cache
def _entry_points() -> Any:
    """The entry points of installed packages; reading them takes as long for one kind as for all."""
    return importlib.metadata.entry_points()


def _load_own(kind: Kind) -> None:
    package = importlib.import_module(f"zoobench.{kind}")
    for module in pkgutil.iter_modules(getattr(package, "__path__", [])):
        if not module.name.startswith("_") and module.name != "base":
            importlib.import_module(f"{package.__name__}.{module.name}")


def _discover(kind: Kind) -> None:
    if kind in _discovered:
        return
    _load_own(kind)
    group = f"zoobench.{kind}"
    for entry_point in _entry_points().select(group=group):
        try:
            entry_point.load()
        except (Exception, SystemExit) as error:  # a plug-in may raise anything; it must not affect other components
            _failures.append(PluginFailure(group, entry_point.name, f"{type(error).__name__}: {error}"))
    _discovered.add(kind)
