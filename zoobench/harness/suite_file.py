"""The form of a suite file: YAML whose keys and types are checked by models; references are read elsewhere."""

from collections.abc import Hashable
from reprlib import Repr
from typing import Annotated, Any

import yaml
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError
from pydantic_core import ErrorDetails

from zoobench.errors import UnknownNameError, UsageError
from zoobench.harness.grid import MOST_SEEDS

Names = str | Annotated[list[str], Field(min_length=1)]
Count = Annotated[int, Field(ge=1)]
Seed = Annotated[int, Field(ge=0)]
Amount = str | int | float
Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1)]
_FORM = ConfigDict(extra="forbid", strict=True)
_MAPPING = "keys with values"
_LONGEST_NUMBER = 100  # characters
_SHORT = Repr()  # of what was given: aliases may make a small file large
_SHORT.maxstring = _SHORT.maxother = 200
_SHORT.maxlevel = _SHORT.maxlist = _SHORT.maxdict = 3


def _names(kind: str) -> Any:
    return Field(default=None, description=f"a name as `zoobench list {kind}` shows them, or a list of names")


class GridSettings(BaseModel):
    """The settings of one grid, or those that grids have in common; None where they are not stated."""

    model_config = _FORM
    envs: Names | None = _names("envs")
    tasks: Names | None = _names("tasks")
    designs: Names | None = _names("designs")
    controllers: Names | None = _names("controllers")
    methods: Names | None = _names("methods")
    seeds: Annotated[Count, Field(le=MOST_SEEDS)] | Annotated[list[Seed], Field(min_length=1)] | None = Field(
        default=None, description=f"how many seeds (3, at most {MOST_SEEDS:,}) or which ([0, 1, 2])"
    )
    budget: Amount | dict[str, Amount] | None = Field(
        default=None, description="a budget such as '126000 substeps' or '60 seconds', or one for each environment"
    )
    fidelity: str | dict[str, str] | None = Field(
        default=None, description="the name of a fidelity such as 'draft', or one for each environment"
    )
    frames: Count | None = Field(default=None, description="a whole number from 1 upwards")
    part: str | None = Field(default=None, description="text: a name that `parts` explains")


class SuiteFile(BaseModel):
    """The content of a suite file."""

    model_config = _FORM
    summary: Line = Field(description="a line of text")
    parts: dict[str, Line] = Field(default_factory=dict, description="the purpose of each part, a line of text")
    common: GridSettings = Field(default_factory=lambda: GridSettings(), description=_MAPPING)
    grids: Annotated[list[GridSettings], Field(min_length=1)] = Field(description="a list of at least one grid")

    def merged(self) -> list[dict[str, Any]]:
        """The settings of each grid with the common ones where it states none."""
        stated = [{name: getattr(each, name) for name in each.model_fields_set} for each in (self.common, *self.grids)]
        return [{**dict.fromkeys(GridSettings.model_fields), **stated[0], **own} for own in stated[1:]]


def parse(content: str, file: str) -> SuiteFile:
    """Read the content of a suite file; `file` is its name, for messages.

    Raises:
        UsageError: it is no YAML, or has another form: names file, grid, key, what was given and what was expected.
    """
    try:
        # A SafeLoader: nothing but plain data comes from a file.
        document = yaml.load(content, _Loader)
    except (yaml.YAMLError, ValueError, AttributeError) as error:  # the latter of scalars with a wrong tag
        raise UsageError(f"Cannot read {file} as YAML: {' '.join(str(error).split())}.") from None
    except RecursionError:
        raise UsageError(f"Cannot read {file} as YAML: it is nested too deep. Write grids as a flat list.") from None
    try:
        found = SuiteFile.model_validate(document)
    except ValidationError as error:
        raise _refusal(error.errors()[0], document, file) from None
    _check_parts(found, file)
    return found


def _check_parts(found: SuiteFile, file: str) -> None:
    """Every grid of a suite with parts belongs to one, and every part has a grid."""
    named = [grid["part"] for grid in found.merged()]
    for number, name in enumerate(named, start=1):
        if name not in (found.parts or [None]):
            known = ", ".join(found.parts) or "no part at all"
            raise UsageError(f"{file}, grid {number}, part: {name!r}, expected one that `parts` explains: {known}.")
    if empty := [name for name in found.parts if name not in named]:
        raise UsageError(f"{file}, parts: no grid belongs to {empty[0]!r}. Give one `part: {empty[0]}`.")


def _refusal(error: ErrorDetails, document: Any, file: str) -> UsageError:
    """The first error of a file in the words of zoobench; its place ends with a key of a model."""
    path = error["loc"][: {"grids": 3, "common": 2}.get(str(next(iter(error["loc"]), "")), 1)]
    names = list(map(str, path))
    if names[:1] == ["grids"] and len(path) > 1:
        names = [f"grid {int(path[1]) + 1}", *names[2:]]
    fields = GridSettings.model_fields if len(path) > 1 else SuiteFile.model_fields
    if error["type"] in ("extra_forbidden", "invalid_key"):
        return UnknownNameError(f"key in {', '.join([file, *names[:-1]])}:", names[-1], fields)
    field = fields.get(names[-1]) if names else None
    value = document
    for part in path:
        value = value.get(part) if isinstance(value, dict) else value[part]
    given = "nothing" if value is None else _SHORT.repr(value)
    expected = _MAPPING if field is None else field.description
    return UsageError(f"{', '.join([file, *names])}: {given}, expected {expected}.")


class _Loader(yaml.SafeLoader):
    """YAML in which a key may not come twice, as the first would be lost in silence, and that knows no dates.

    Whole numbers have a bounded length: Python writes none of more than 4,300 digits, not even in a message.
    """

    def construct_yaml_int(self, node: yaml.ScalarNode) -> int:
        if len(node.value) > _LONGEST_NUMBER:
            problem = f"a number of {len(node.value):,} characters, expected at most {_LONGEST_NUMBER}"
            raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
        return super().construct_yaml_int(node)

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Hashable, Any]:
        seen: set[str] = set()
        for key in (key for key, _ in node.value if isinstance(key, yaml.ScalarNode)):
            if key.value in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"the key {key.value!r} comes twice", key.start_mark
                )
            seen.add(key.value)
        return super().construct_mapping(node, deep)


_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.construct_yaml_int)
_Loader.yaml_implicit_resolvers = {
    sign: [each for each in resolvers if each[0] != "tag:yaml.org,2002:timestamp"]
    for sign, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
