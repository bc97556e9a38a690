"""Vega, Vega-Lite and Vega-Embed as one script, which every page holds.

The library that has them takes more memory than a report of a hundred thousand runs, and seconds, so that a process of
its own takes them out, once for each version.
"""

import subprocess
import sys
from contextlib import suppress
from importlib.metadata import version

from zoobench.errors import ZoobenchError
from zoobench.files import cache_folder, replace_files

LIBRARY = "vl_convert"

_PROGRAM = f"import sys, {LIBRARY}; sys.stdout.buffer.write({LIBRARY}.javascript_bundle(None).encode())"


def bundle() -> str:
    """The script.

    Raises:
        ZoobenchError: the library does not give it.
    """
    kept = cache_folder() / f"vega-{version('vl-convert-python')}.js"
    with suppress(OSError):
        return kept.read_text(encoding="utf-8")
    done = subprocess.run([sys.executable, "-c", _PROGRAM], capture_output=True, check=False)
    if done.returncode:
        last = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        raise ZoobenchError(f"{LIBRARY} does not give the script of the charts: {last}")
    with suppress(OSError):  # the cache may be no place to write
        replace_files({kept: done.stdout}, make_folders=True)
    return done.stdout.decode()
