"""Everything that is written in the kernel language."""

import linecache
import sys

from taichi.lang import kernel_impl


def _inside_class(level_of_class_stackframe: int) -> bool:
    """Taichi's own test whether a function is defined in a class, by the line that the frame is at.

    Taichi asks `inspect` for the line, which looks through all loaded modules, for every kernel function: with torch,
    that takes longer than to import the kernels.
    """
    try:
        frame = sys._getframe(level_of_class_stackframe)
    except ValueError:  # the function is that of a script, and there is no frame around it
        return False
    line = linecache.getline(frame.f_code.co_filename, frame.f_lineno, frame.f_globals).strip()
    return any(pattern.match(line) for pattern in kernel_impl._KERNEL_CLASS_STACKFRAME_STMT_RES)


kernel_impl._inside_class = _inside_class
