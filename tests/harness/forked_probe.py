"""A process that tells what it is, `forked_probe.py WORD`, and for the word `sleep` does not end."""

import atexit
import json
import os
import sys
import threading
import time
from contextlib import suppress
from pathlib import Path

atexit.register(print, "the end", file=sys.stderr)
descriptors = []
for each in Path("/proc/self/fd").iterdir():
    with suppress(FileNotFoundError):  # that of the list itself
        descriptors.append(str(each.readlink()))
facts = {
    "arguments": sys.argv[1:],
    "environment": dict(os.environ),
    "loaded": "taichi" in sys.modules,
    "parent": os.getppid(),
    "threads": threading.active_count(),
    "descriptors": descriptors,
}
print(json.dumps(facts), flush=True)
if "sleep" in sys.argv:
    time.sleep(600.0)
sys.exit(len(sys.argv) - 1)
