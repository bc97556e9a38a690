"""The words for kinds of components on the command line."""

from collections.abc import Iterable
from enum import StrEnum

from zoobench.errors import UnknownNameError


class KindName(StrEnum):
    """The kinds, as `zoobench list` prints them."""

    ENVS = "envs"
    TASKS = "tasks"
    DESIGNS = "designs"
    CONTROLLERS = "controllers"
    METHODS = "methods"
    FIDELITIES = "fidelities"
    SUITES = "suites"
    PRESETS = "presets"
    SOLUTIONS = "solutions"

    @property
    def singular(self) -> str:
        """The word for one of them."""
        return f"{self[:-3]}y" if self.endswith("ies") else self[:-1]


def kind_named(text: str, offered: Iterable[KindName] = KindName) -> KindName:
    """The kind of that name, in the plural, the singular or in full: `envs`, `env`, `environment`.

    Raises:
        UnknownNameError: it is none of those that are offered.
    """
    kinds = list(offered)
    found = {name: kind for kind in kinds for name in (kind.value, kind.singular)}
    if KindName.ENVS in kinds:
        found |= {"environment": KindName.ENVS, "environments": KindName.ENVS}
    if text not in found:
        raise UnknownNameError("kind", text, [kind.value for kind in kinds])
    return found[text]
