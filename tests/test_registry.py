"""The registry: discovery, resolved references, and refusals with a remedy."""

from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any, Literal

import pytest

from zoobench import registry
from zoobench.errors import UnknownNameError, UsageError
from zoobench.inputs import FROM_NONE, StoredRun
from zoobench.registry import Kind, register, short
from zoobench.spec import Ref


@pytest.fixture(autouse=True)
def _own_registry(monkeypatch: pytest.MonkeyPatch) -> None:
    registry.failures()  # the real components register when they are first imported: not in a registry that goes away
    monkeypatch.setattr(registry, "_components", {kind: {} for kind in Kind})
    monkeypatch.setattr(registry, "_discovered", set(Kind))
    monkeypatch.setattr(registry, "_failures", [])

    @register(Kind.TASK, "hopping", tags=("new",))
    def hopping(
        *, height: float = 1, count: int = 3, side: Literal["left", "right"] = "left", soft: bool = True
    ) -> str:
        """Hop on one foot.

        More text.
        """
        return f"{height} {count} {side} {soft}"

    @register(Kind.TASK, "hopping", version=2)
    def hopping_again(*, target: str) -> str:
        """Hop to somewhere."""
        return target


def test_a_component_is_described_by_its_factory() -> None:
    """Summary and defaults come from docstring and signature, tags from the decorator."""
    component = registry.get(Kind.TASK, "hopping", 1)
    assert component.summary == "Hop on one foot."
    assert component.tags == {"new"}
    assert component.defaults == {"height": 1.0, "count": 3, "side": "left", "soft": True}


def test_the_newest_version_is_the_default() -> None:
    """Version 0 means the newest registered one."""
    assert registry.get(Kind.TASK, "hopping").version == 2


def test_a_resolved_reference_states_everything() -> None:
    """Defaults are filled in and values have the parameter's type, so that equal runs have equal keys."""
    whole = registry.resolve(Kind.TASK, Ref.parse("hopping-v1[height=2,count=4.0]"))
    assert whole == Ref.parse("hopping-v1[height=2.0,count=4,side=left,soft=true]")
    assert isinstance(whole.kwargs["height"], float)
    assert isinstance(whole.kwargs["count"], int)
    assert registry.resolve(Kind.TASK, whole) == whole


def _moor(**more: Any) -> None:
    @register(Kind.ENV, "moor", **more)
    def moor(*, depth: float = 0.5, gravity: float = 9.81, start: StoredRun = FROM_NONE) -> float:
        """A moor with hills."""
        return depth * gravity


@pytest.mark.parametrize("text", ["moor", "moor[gravity=9.81]", "moor-v1[depth=0.5]", "moor[start=]"])
def test_an_added_parameter_at_its_default_is_left_out(text: str) -> None:
    """The reference, and so the key of a run, is that of the package's versions without the parameter."""
    _moor(added=("gravity",))
    ref = Ref.parse(text) if text != "moor[start=]" else Ref("moor", params=(("start", ""),))
    assert str(registry.resolve(Kind.ENV, ref)) == "moor-v1[depth=0.5]"
    assert str(registry.get(Kind.ENV, "moor").ref) == "moor-v1[depth=0.5]"
    assert registry.create(Kind.ENV, ref) == 0.5 * 9.81


def test_an_added_parameter_with_another_value_is_stated() -> None:
    """It is another run, and the value reaches the component; so does that of a reference that is resolved again."""
    _moor(added=("gravity",))
    moon = registry.resolve(Kind.ENV, Ref.parse("moor[gravity=2]"))
    assert str(moon) == "moor-v1[depth=0.5,gravity=2.0]"
    assert registry.resolve(Kind.ENV, moon) == moon
    assert registry.create(Kind.ENV, moon) == 1.0


def test_a_reference_means_what_it_meant_before_a_default_changed() -> None:
    """With a version it leaves out the value that was, without one it has the default; new ones state either."""
    _moor(was={"gravity": 2.0}, version=2)
    stored, usual = Ref.parse("moor-v2[depth=0.5]"), registry.resolve(Kind.ENV, Ref("moor"))
    light = registry.resolve(Kind.ENV, Ref.parse("moor[gravity=2]"))
    assert str(light) == "moor-v2[depth=0.5,gravity=2.0]"
    assert registry.resolve(Kind.ENV, stored) == light
    assert registry.create(Kind.ENV, stored) == 1.0
    assert short(Kind.ENV, stored) == short(Kind.ENV, Ref.parse("moor-v1[depth=3.0]")) == "moor[gravity=2.0]"
    assert str(usual) == "moor-v2[depth=0.5,gravity=9.81]"
    assert registry.create(Kind.ENV, usual) == 0.5 * 9.81
    assert short(Kind.ENV, usual) == "moor"


@dataclass(frozen=True, kw_only=True)
class _Weather:
    """The weather.

    * `wind`: speed [m/s].
    """

    wind: float = 3
    rain: bool = False

    def __post_init__(self) -> None:
        if self.wind < 0.0:
            raise UsageError("Give a speed of 0 or more.")


def _marsh(**more: Any) -> None:
    @register(Kind.ENV, "marsh", **more)
    def marsh(*, depth: float = 0.5, weather: _Weather = _Weather(wind=5.0)) -> tuple[float, float, bool]:
        """A marsh.

        * `depth`: [m].
        """
        return depth, weather.wind, weather.rain


def test_a_group_is_parameters_of_the_component() -> None:
    """Its fields have type, default and documentation in the component, whose default instance gives the defaults."""
    _marsh()
    marsh = registry.get(Kind.ENV, "marsh")
    assert marsh.parameters == {"depth": float, "wind": float, "rain": bool}
    assert str(marsh.ref) == "marsh-v1[depth=0.5,rain=False,wind=5.0]"
    assert "* `depth`: [m]." in marsh.description
    assert "* `wind`: speed [m/s]." in marsh.description
    assert registry.create(Kind.ENV, Ref.parse("marsh[rain=true,depth=1]")) == (1.0, 5.0, True)
    with pytest.raises(UsageError, match="Give a speed of 0"):
        registry.create(Kind.ENV, Ref.parse("marsh[wind=-1]"))
    with pytest.raises(UnknownNameError, match="Did you mean 'wind'"):
        registry.resolve(Kind.ENV, Ref.parse("marsh[wnd=1]"))


def test_a_group_can_be_added_as_a_whole() -> None:
    """Each of its fields is left out while it has the component's default."""
    _marsh(added=("weather",))
    assert str(registry.resolve(Kind.ENV, Ref("marsh"))) == "marsh-v1[depth=0.5]"
    windy = registry.resolve(Kind.ENV, Ref.parse("marsh[wind=3]"))
    assert str(windy) == "marsh-v1[depth=0.5,wind=3.0]"
    assert registry.create(Kind.ENV, windy) == (0.5, 3.0, False)


def test_a_group_may_not_hide_another_parameter() -> None:
    """Two parameters of one name could not be told apart."""
    with pytest.raises(UsageError, match="two parameters 'wind'"):

        @register(Kind.ENV, "fen")
        def fen(*, wind: float = 1.0, weather: _Weather = _Weather()) -> float:
            """A fen."""
            return wind


def test_a_parameter_that_is_not_there_cannot_be_an_added_one() -> None:
    """A misspelt name is refused where it is written; so is a required parameter, which has no default."""
    with pytest.raises(UsageError, match="no parameter 'gravitiy'"):
        _moor(added=("gravitiy",))
    with pytest.raises(UsageError, match="no parameter 'target'"):

        @register(Kind.TASK, "diving", added=("target",))
        def diving(*, target: str) -> str:
            """Dive to somewhere."""
            return target


def test_create_calls_the_factory_with_the_parameters() -> None:
    """Values of the reference and defaults."""
    assert registry.create(Kind.TASK, Ref.parse("hopping-v1[side=right]")) == "1.0 3 right True"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("hopping-v1[count=2.5]", "'count' must be a whole number"),
        ("hopping-v1[height=tall]", "'height' must be a finite number"),
        ("hopping-v1[height=nan]", "'height' must be a finite number"),
        ("hopping-v1[soft=1]", "'soft' must be true or false"),
        ("hopping-v1[side=up]", "Choose one of left, right"),
        ("hopping-v1[heigth=2]", "Did you mean 'height'?"),
        ("hopping", "hopping[target=...]"),
        ("hopping-v7", "Known: hopping-v1, hopping-v2"),
    ],
)
def test_a_reference_that_does_not_fit_is_refused(text: str, told: str) -> None:
    """The message of each mistake has the remedy."""
    with pytest.raises(UsageError) as caught:
        registry.resolve(Kind.TASK, Ref.parse(text))
    assert told in str(caught.value)


def test_a_parameter_of_others_is_told_with_those_that_have_it() -> None:
    """Rather than with parameters of similar names, which mean something else."""
    _marsh()

    @register(Kind.ENV, "moor")
    def moor(*, winds: float = 1.0) -> float:
        """A moor."""
        return winds

    with pytest.raises(UsageError, match=r"'moor' has no parameter 'wind'\. Leave it out, .* have it: marsh\.$"):
        registry.resolve(Kind.ENV, Ref.parse("moor[wind=1]"))


def test_an_unknown_name_suggests_the_nearest() -> None:
    """With "did you mean"."""
    with pytest.raises(UnknownNameError, match=r"Unknown task 'hoping'\. Did you mean 'hopping'\?"):
        registry.get(Kind.TASK, "hoping")


def test_a_name_is_registered_once() -> None:
    """A second component of the same name and version is refused, and the first is kept."""
    with pytest.raises(UsageError, match="registered already"):
        register(Kind.TASK, "hopping")(lambda: None)
    assert registry.create(Kind.TASK, Ref("hopping", 1)).startswith("1.0")


@pytest.mark.parametrize("name", ["Hopping", "hop_ping", "", "hop--ping"])
def test_a_name_is_kebab_case(name: str) -> None:
    """A name that could not be typed as a reference is refused."""
    with pytest.raises(UsageError, match="kebab-case"):
        register(Kind.TASK, name)


def test_a_factory_that_hides_its_parameters_is_refused() -> None:
    """Parameters need names and types, and defaults that a key can contain."""
    with pytest.raises(UsageError, match="Name every parameter"):
        register(Kind.TASK, "loose")(lambda **anything: anything)
    with pytest.raises(UsageError, match="has no type"):
        register(Kind.TASK, "vague")(lambda where="here": where)

    def nowhere(*, where: str | None = None) -> None: ...

    with pytest.raises(UsageError, match="not a bool, int, float or str"):
        register(Kind.TASK, "nowhere")(nowhere)
    assert not {"loose", "vague", "nowhere"} & set(registry.names(Kind.TASK))


class _EntryPoint:
    def __init__(self, name: str, error: Exception | None) -> None:
        self.name, self._error = name, error

    def load(self) -> None:
        if self._error is not None:
            raise self._error
        register(Kind.ENV, self.name)(lambda: self.name)


def test_a_broken_plugin_is_listed_and_harms_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is a failure to show; other plug-ins are loaded."""
    points = {"zoobench.envs": [_EntryPoint("broken", ImportError("no such thing")), _EntryPoint("moon", None)]}
    found = SimpleNamespace(select=lambda group: points.get(group, []))
    monkeypatch.setattr(registry, "_entry_points", lambda: found)
    monkeypatch.setattr(registry, "_discovered", set(Kind) - {Kind.ENV})
    assert "moon" in registry.names(Kind.ENV)
    assert [(failure.entry_point, failure.reason) for failure in registry.failures()] == [
        ("broken", "ImportError: no such thing")
    ]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ("hopping-v1", "hopping"),
        ("hopping-v1[count=4]", "hopping[count=4]"),
        ("hopping-v1[count=3,side=left]", "hopping"),
        ("of-a-plugin[a=1]", "of-a-plugin"),
    ],
)
def test_short_name_has_what_differs_from_the_defaults(given: str, expected: str) -> None:
    """Tables of two variants of a fidelity must not have one title; of what is not known the name is left."""
    assert short(Kind.TASK, Ref.parse(given)) == expected


@pytest.mark.parametrize(("text", "caveat"), [("moor", ""), ("moor[depth=1.0]", "Not known."), ("moor-v1", "")])
def test_scores_are_provisional_but_for_some_parameters(text: str, caveat: str) -> None:
    """Given or by default, also where a resolved reference leaves them out."""
    _moor(added=("depth",), provisional="Not known.", unless={"depth": 0.5})
    assert registry.caveat(Kind.ENV, Ref.parse(text)) == caveat
    assert registry.caveat(Kind.ENV, registry.resolve(Kind.ENV, Ref.parse(text))) == caveat
