"""Files as settings: identified by content, refused if changed."""

from pathlib import Path

import pytest

from zoobench import registry
from zoobench.errors import UsageError
from zoobench.inputs import path_of, pin, read
from zoobench.registry import Kind
from zoobench.spec import Ref


def test_a_pin_is_the_name_with_the_digest(tmp_path: Path) -> None:
    """Path and content can be read from it, and pinning twice changes nothing."""
    path = tmp_path / "a.stl"
    path.write_bytes(b"abc")
    pinned = pin(str(path))
    assert pinned.endswith("@sha256-ba7816bf8f01cfea")  # FIPS 180-2, example B.1
    assert pin(pinned) == pinned
    assert path_of(pinned) == path
    assert read(pinned) == read(str(path)) == b"abc"


def test_a_changed_file_is_refused_and_makes_another_run(tmp_path: Path) -> None:
    """The resolved reference, and so the run's key, contains the digest."""
    path = tmp_path / "a.stl"
    path.write_bytes(b"abc")
    ref = Ref("mesh", params=(("path", str(path)),))
    first = registry.resolve(Kind.DESIGN, ref)
    assert registry.resolve(Kind.DESIGN, first) == first == Ref.parse(str(first))
    path.write_bytes(b"abd")
    assert registry.resolve(Kind.DESIGN, ref) != first
    with pytest.raises(UsageError, match="has changed"):
        registry.create(Kind.DESIGN, first)


@pytest.mark.parametrize("name", ["nowhere.stl", "a,b.stl", "."])
def test_a_file_that_cannot_be_a_setting_is_refused(name: str) -> None:
    """It is missing, a folder, or its name contains reserved characters."""
    with pytest.raises(UsageError, match=r"cannot be read|regular file|cannot be a setting"):
        pin(name)
