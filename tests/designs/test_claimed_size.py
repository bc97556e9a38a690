"""Files that claim more than they hold are refused before a library believes them."""

import io
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from zoobench.designs import claimed_size
from zoobench.designs.cloud_file import load_points
from zoobench.errors import UsageError


def _pcd(form: str, points: int, rest: bytes, count: int = 1) -> bytes:
    header = (
        f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z q\nSIZE 4 4 4 4\nTYPE F F F F\nCOUNT 1 1 1 {count}\n"
        f"WIDTH {points}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {form}\n"
    )
    return header.encode() + rest


def _npz(shape: tuple[int, ...], content: bytes) -> bytes:
    array, archive = io.BytesIO(), io.BytesIO()
    np.lib.format.write_array_header_1_0(array, {"descr": "<f8", "fortran_order": False, "shape": shape})
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("positions.npy", array.getvalue() + content)
    return archive.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("columns.pcd", _pcd("binary", 3, bytes(8), count=10**9), "declares 1,000,000,003 columns"),
        ("ascii.pcd", _pcd("ascii", 10**9, b"0 0 0 0\n"), "declares 1,000,000,000 points"),
        ("binary.pcd", _pcd("binary", 10**9, bytes(16)), "declares 1,000,000,000 points"),
        (
            "packed.pcd",
            _pcd("binary_compressed", 10**8, struct.pack("<II", 8, 16 * 10**8) + bytes(8)),
            "declares 100,000,000 points",
        ),
        ("shape.npz", _npz((10**10, 3), bytes(24)), "claims 240,000,000,000 bytes and has"),
    ],
)
def test_a_file_that_claims_a_size_is_refused(tmp_path: Path, name: str, content: bytes, reason: str) -> None:
    """In words, and without a table of that size."""
    assert len(content) < 300
    (tmp_path / name).write_bytes(content)
    with pytest.raises(UsageError, match=reason):
        load_points(str(tmp_path / name))


def test_a_file_that_unpacks_to_too_much_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Zeros pack to a thousandth."""
    content = _npz((10_000, 3), bytes(240_000))
    assert len(content) < 1000
    claimed_size.check_npz(content)
    monkeypatch.setattr(claimed_size, "_MOST_BYTES", 100_000)
    with pytest.raises(ValueError, match="unpacks to 240,128 bytes, and 100,000 are the most"):
        claimed_size.check_npz(content)
