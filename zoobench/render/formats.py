"""File formats of films."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from zoobench.errors import UsageError


class FilmFormat(StrEnum):
    """Moving pictures, a sheet of pictures, or the frames for other tools."""

    MP4 = "mp4"
    GIF = "gif"
    PNG = "png"
    NPZ = "npz"
    VTK = "vtk"

    @property
    def suffix(self) -> str:
        """Ending of its files; of a series of VTK files, that of the index."""
        return ".pvd" if self is FilmFormat.VTK else f".{self}"

    @property
    def is_picture(self) -> bool:
        """Whether writing it needs drawing."""
        return self in (FilmFormat.MP4, FilmFormat.GIF, FilmFormat.PNG)


@dataclass(frozen=True)
class Destination:
    """A file and its format."""

    path: Path
    form: FilmFormat


def destination(path: Path, form: FilmFormat | None) -> Destination:
    """The file to write, with the format by its ending or the ending by the format.

    Raises:
        UsageError: neither is given, they contradict each other, or the folder does not exist.
    """
    by_suffix = {each.suffix: each for each in FilmFormat}
    endings = ", ".join(by_suffix)
    suffix = path.suffix.lower()
    if not suffix and form is None:
        raise UsageError(f"{str(path)!r} has no ending that names a format. Give one of {endings}, or --format.")
    if not suffix and form is not None:
        path = path.with_name(path.name + form.suffix)
    elif suffix not in by_suffix:
        raise UsageError(f"{str(path)!r} ends in {path.suffix!r}, which is no format of films. Give one of {endings}.")
    found = by_suffix[path.suffix.lower()]
    if form not in (None, found):
        raise UsageError(f"{str(path)!r} is no {form} file. Let it end in {form.suffix}, or leave --format out.")
    if not path.parent.is_dir():
        raise UsageError(f"There is no folder {str(path.parent)!r} to write {path.name} into. Make it first.")
    return Destination(path, found)
