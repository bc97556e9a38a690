"""The machine code of the substep and of its reverse, by which processors of different make give the same bits."""

import os
import re
import subprocess
import sys
from pathlib import Path

_PROGRAM = """
import taichi as ti
started = ti.init
ti.init = lambda **settings: started(**settings | {"offline_cache": False, "print_kernel_asm": True})
from tests.sim import scenes
scenes.episode(scenes.SCENES["sand"](), 1)
"""


def test_no_product_is_fused_with_a_sum(tmp_path: Path) -> None:
    """A fused product is rounded once instead of twice, and not every processor has it."""
    place = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parents[3]), os.environ.get("PYTHONPATH", "")])}
    subprocess.run([sys.executable, "-c", _PROGRAM], cwd=tmp_path, env=os.environ | place, check=True, timeout=300)
    code = "\n".join(path.read_text() for path in tmp_path.glob("*.s"))
    products = re.findall(r"^\s+(v?mulp[sd]|fmul|fmla)\b", code, re.MULTILINE)
    assert len(products) > 300, "the kernels were printed"
    assert not re.findall(r"^\s+(vfn?m(?:add|sub)\w*|fmla|fmadd)\b", code, re.MULTILINE)
