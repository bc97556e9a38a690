"""Short names of components."""

from zoobench import registry
from zoobench.registry import Kind
from zoobench.report.labels import labels
from zoobench.spec import Ref


def test_a_name_alone_is_enough_where_nothing_else_has_it() -> None:
    """Parameters that tell nothing apart are left out."""
    ref = Ref.parse("random-v1[batch=4]")
    assert labels([ref, ref, Ref.parse("other-v2")])[ref] == "random"


def test_only_what_differs_is_shown() -> None:
    """Two settings of a method differ in lr alone, two versions in the version alone."""
    slow, fast = Ref.parse("adam-v1[clip=1.0,lr=0.1]"), Ref.parse("adam-v1[clip=1.0,lr=0.5]")
    old, new = Ref.parse("desert-v1"), Ref.parse("desert-v2")
    found = labels([slow, fast, old, new])
    assert [found[ref] for ref in (slow, fast, old, new)] == [
        "adam[lr=0.1]",
        "adam[lr=0.5]",
        "desert-v1",
        "desert-v2",
    ]


def test_the_object_of_an_environment_is_shown_where_all_have_it() -> None:
    """As every setting that is no default, also of a version that is gone."""
    text = "ground-v{}[friction=0.5,object=ball,relief=0.0]"
    for version in (registry.get(Kind.ENV, "ground").version, 1):
        ref = Ref.parse(text.format(version))
        assert labels([ref], Kind.ENV)[ref] == "ground[object=ball]"
    slippery = Ref.parse("ground-v1[friction=0.2,object=ball,relief=0.0]")
    assert labels([ref, slippery], Kind.ENV)[slippery] == "ground[friction=0.2,object=ball]"
    assert labels([ref])[ref] == "ground"


def test_labels_stand_in_the_order_of_their_references() -> None:
    """So that columns do, and a page that is built twice is the same."""
    refs = [Ref.parse(f"ground-v1[height={number}]") for number in range(12)]
    assert list(labels(reversed(refs))) == refs[::-1]
