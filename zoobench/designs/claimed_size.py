"""The size that a file claims to have, checked before a library believes it and fills the memory."""

import io
import math
import zipfile

import numpy as np

_MOST_BYTES = 1 << 28  # of a table: a million points with every column take 100 MB
_MOST_COLUMNS = 1000
_LEAST_BYTES = {"ascii": 2.0, "binary": 1.0, "binary_compressed": 0.01}  # of a file, per byte or number in its table


def check_npz(content: bytes) -> None:
    """Raise ValueError if the arrays of a NumPy archive are larger than they can be."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        total = sum(member.file_size for member in members)
        if total > _MOST_BYTES:
            raise ValueError(f"it unpacks to {total:,} bytes, and {_MOST_BYTES:,} are the most")
        for member in members:
            with archive.open(member) as file:
                version = np.lib.format.read_magic(file)
                read = np.lib.format.read_array_header_1_0 if version[0] == 1 else np.lib.format.read_array_header_2_0
                shape, _, kind = read(file)
            claimed = math.prod(shape) * kind.itemsize
            if claimed > member.file_size:
                raise ValueError(f"{member.filename} claims {claimed:,} bytes and has {member.file_size:,}")


def check_pcd(content: bytes) -> None:
    """Raise ValueError if the header of a PCD file claims more than the file can hold."""
    header = dict.fromkeys(("SIZE", "COUNT", "POINTS", "DATA"), "")
    for line in io.BytesIO(content):
        name, _, value = line.decode("latin-1").strip().partition(" ")
        if name in header:
            header[name] = value
        if name == "DATA":
            break
    sizes = [int(size) for size in header["SIZE"].split()]
    counts = [int(count) for count in header["COUNT"].split()] or [1] * len(sizes)
    points, form = int(header["POINTS"]), header["DATA"].strip().lower()
    if sum(counts) > _MOST_COLUMNS:
        raise ValueError(f"its header declares {sum(counts):,} columns, and {_MOST_COLUMNS:,} are the most")
    each = sum(counts) if form == "ascii" else sum(size * count for size, count in zip(sizes, counts, strict=True))
    if points * each * _LEAST_BYTES.get(form, 1.0) > len(content) + 2 or points * each > _MOST_BYTES:
        raise ValueError(f"its header declares {points:,} points, and the file has {len(content):,} bytes")
