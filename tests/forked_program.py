"""`forked_program.py FOLDER WORDS` does in a folder what `python WORDS` would: run a file, or `-m` a module."""

import os
import runpy
import sys
from pathlib import Path

if __name__ == "__main__":
    folder, *words = sys.argv[1:]
    os.chdir(folder)
    # a process that was forked has not looked at it
    sys.path[:0] = [place for place in os.environ.get("PYTHONPATH", "").split(os.pathsep) if place not in sys.path]
    if words[0] == "-m":
        sys.argv = words[1:]
        runpy.run_module(words[1], run_name="__main__", alter_sys=True)
    else:
        sys.argv = words
        runpy.run_path(str(Path(words[0]).absolute()), run_name="__main__")
