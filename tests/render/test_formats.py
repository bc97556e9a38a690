"""What is written is said by the ending or the format."""

from pathlib import Path

import pytest

from zoobench.errors import UsageError
from zoobench.render.formats import FilmFormat, destination


@pytest.mark.parametrize(
    ("given", "form", "name", "found"),
    [
        ("run.mp4", None, "run.mp4", FilmFormat.MP4),
        ("run.GIF", None, "run.GIF", FilmFormat.GIF),
        ("run", FilmFormat.NPZ, "run.npz", FilmFormat.NPZ),
        ("run", FilmFormat.VTK, "run.pvd", FilmFormat.VTK),
        ("run.pvd", FilmFormat.VTK, "run.pvd", FilmFormat.VTK),
    ],
)
def test_ending_and_format_say_the_same(
    tmp_path: Path, given: str, form: FilmFormat | None, name: str, found: FilmFormat
) -> None:
    """Either is enough."""
    target = destination(tmp_path / given, form)
    assert (target.path.name, target.form) == (name, found)


@pytest.mark.parametrize(
    ("given", "form", "message"),
    [
        ("run", None, "has no ending"),
        ("run.avi", None, "ends in '.avi'"),
        ("run.avi", FilmFormat.MP4, "ends in '.avi'"),
        ("run.mp4", FilmFormat.NPZ, "is no npz"),
        ("nowhere/run.mp4", None, "There is no folder"),
    ],
)
def test_what_cannot_be_written_is_refused(tmp_path: Path, given: str, form: FilmFormat | None, message: str) -> None:
    """With what to give instead."""
    with pytest.raises(UsageError, match=message):
        destination(tmp_path / given, form)
