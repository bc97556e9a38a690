"""Short names for components, as much of a reference as tells it from the others shown, and their order."""

from collections.abc import Collection, Iterable

from zoobench.registry import Kind, unusual
from zoobench.spec import Budget, Ref, Scalar


def labels(refs: Iterable[Ref], kind: Kind | None = None) -> dict[Ref, str]:
    """A label for each reference: its name, with the version and the parameters only where they differ.

    Names stand in the order of their first references, and so do the references of a name. Of components of a `kind`
    other parameters than the default ones stay, though all share them: an environment with an object is another.
    """
    families: dict[str, dict[Ref, None]] = {}
    for ref in refs:
        families.setdefault(ref.name, {})[ref] = None
    return {
        ref: _label(ref, family, {} if kind is None else unusual(kind, ref))
        for family in families.values()
        for ref in family
    }


def _label(ref: Ref, family: Collection[Ref], kept: dict[str, Scalar]) -> str:
    version = ref.version if len({other.version for other in family}) > 1 else 0
    params = kept | {key: value for key, value in ref.params if _differs(key, value, family)}
    return str(Ref(ref.name, version, tuple(sorted(params.items()))))


def _differs(key: str, value: Scalar, family: Collection[Ref]) -> bool:
    return any(other.kwargs.get(key) != value for other in family)


def in_order(setting: Ref | Budget | int) -> tuple[object, ...]:
    """The key by which settings are sorted: names and texts by the alphabet, versions and numbers by their size."""
    if isinstance(setting, Ref):
        params = ((key, *_by_size(value)) for key, value in setting.params)
        return setting.name, setting.version, tuple(params)
    return (setting.kind, setting.amount) if isinstance(setting, Budget) else (setting,)


def _by_size(value: Scalar) -> tuple[int, float, str]:
    return (0, float(value), "") if isinstance(value, int | float) else (1, 0.0, value)
