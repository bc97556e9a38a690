"""The differentiable MLS-MPM simulator of matter and boundaries, independent of tasks, databases and commands."""

import os

# Taichi prints a banner on standard output, which is reserved for data, when it is imported
os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
# and when it is started, a thread of it asks a server for newer versions
os.environ.setdefault("TI_SKIP_VERSION_CHECK", "ON")
