"""All that is changed in Taichi itself, and only while a kernel of zoobench is compiled or launched for the first time.

`quickened` makes a kernel's intermediate representation of its Python in less time. What it makes computes the same,
with half as many variables: Taichi copies every argument of a function, and whatever is assigned twice. To lower the
kernel, it goes through the whole of it once for each of them. Kernels of other people, which may assign to their
arguments, are compiled by Taichi's own front end.

`seen_launches` watches a launch, so that it can be repeated.
"""

import ast
import functools
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any, NamedTuple

from taichi._lib.core import taichi_python
from taichi.lang import impl, kernel_impl
from taichi.lang.ast.ast_transformer import ASTTransformer, build_stmt
from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext
from taichi.lang.expr import Expr

_WHOLE_POSITION = ASTTransformerContext.get_pos_info
_COPY = impl.expr_init_func
_IN_PLACE = Expr._augassign


@contextmanager
def quickened(*, quotes: bool) -> Iterator[None]:
    """Within, the slow parts are replaced by quick ones.

    Args:
        quotes: whether the syntax nodes of a kernel are quoted, or only their lines named. Taichi asks for the position
            of every node, and to quote them all takes half of its front end.
    """
    quick = _QUICK if quotes else (*_QUICK, (ASTTransformerContext, "get_pos_info", _position))
    usual = [(owner, name, vars(owner).get(name)) for owner, name, _ in quick]
    for owner, name, part in quick:
        setattr(owner, name, part)
    try:
        yield
    finally:
        for owner, name, part in usual:
            if part is None:  # inherited
                delattr(owner, name)
            else:
                setattr(owner, name, part)


def _position(context: ASTTransformerContext, node: ast.stmt | ast.expr) -> str:
    """Where a syntax node is: file and line, quoted with the node underlined only where an error tells of it."""
    if sys.exc_info()[0] is not None:
        return str(_WHOLE_POSITION(context, node))
    return f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:\n'


def _is_variable(value: object) -> bool:
    return isinstance(value, Expr) and value.ptr.is_lvalue() and not value.ptr.is_index_expr()


def _argument(given: Any) -> Any:
    """An argument of a function as it knows it: a variable itself, where Taichi would copy it.

    So a function of a kernel must not assign to its arguments.
    """
    return given if _is_variable(given) else _COPY(given)


def _change(target: Expr, by: Any, operation: str) -> None:
    """`target += by` and the like: of a variable, which no other thread sees, without an atomic operation."""
    if operation == "Add" and _is_variable(target):
        target._assign(target + by)
    elif operation == "Sub" and _is_variable(target):
        target._assign(target - by)
    else:
        _IN_PLACE(target, by, operation)


def _assign(context: ASTTransformerContext, node: ast.Assign) -> None:
    """An assignment: a new variable is the copy that is made of its value, where Taichi would copy that again."""
    given: Any = node.value  # Taichi gives every node that it has built a `ptr`
    build_stmt(context, given)
    called: Any = given.func if isinstance(given, ast.Call) else None
    is_static = called is not None and called.ptr is impl.static
    value = given.ptr if is_static else impl.expr_init(given.ptr)
    for target in node.targets:
        if is_static or len(node.targets) > 1:
            ASTTransformer.build_assign_unpack(context, target, value, is_static)
        else:
            _bind(context, target, value)


def _bind(context: ASTTransformerContext, target: ast.expr, value: Any) -> None:
    """Assign a value that nothing else refers to."""
    if isinstance(target, ast.Tuple) and isinstance(value, (tuple, list)) and len(target.elts) == len(value):
        for each, part in zip(target.elts, value, strict=True):
            _bind(context, each, part)
    elif isinstance(target, ast.Name) and not context.is_var_declared(target.id):
        context.create_variable(target.id, value)
    else:
        ASTTransformer.build_assign_unpack(context, target, value, False)


_ASKED_OFTEN = ("getsourcefile", "getsourcelines", "has_pytorch", "to_taichi_type")
"""Functions that Taichi calls at every call in a kernel and for every array of every launch: the source of a function,
its lines without tabs, whether torch is there, and which of Taichi's types one of torch's is."""

_QUICK = (
    *((kernel_impl, name, functools.cache(getattr(kernel_impl, name))) for name in _ASKED_OFTEN),
    (kernel_impl, "textwrap", SimpleNamespace(**vars(textwrap) | {"fill": functools.cache(textwrap.fill)})),
    (impl, "expr_init_func", _argument),
    (Expr, "_augassign", _change),
    (ASTTransformer, "build_Assign", staticmethod(_assign)),
)
"""The quick parts, each with its owner and its name there."""


class SeenLaunch(NamedTuple):
    """A launch as Taichi made it: the compiled kernel, the context with its arguments, and the calls that made it."""

    kernel: Any
    context: Any
    make: Callable[[], Any]
    settings: list[tuple[Callable[..., None], tuple[Any, ...]]]

    def again(self, *, as_it_was: bool) -> None:
        """Launch it again, with its context or, as on CUDA a context serves one launch, one made by the same calls."""
        context = self.context
        if not as_it_was:
            context = self.make()
            for setting, arguments in self.settings:
                setting(context, *arguments)
        impl.get_runtime().prog.launch_kernel(self.kernel, context)


_SETTERS = ("set_arg_external_array_with_shape", "set_arg_float", "set_arg_int")


@contextmanager
def seen_launches() -> Iterator[list[SeenLaunch]]:
    """The launches that Taichi's runtime receives within the context, seen by watching methods of Taichi."""
    seen: list[SeenLaunch] = []
    settings: list[tuple[Callable[..., None], tuple[Any, ...]]] = []
    makers: list[Callable[[], Any]] = []
    program, kernel, context = type(impl.get_runtime().prog), taichi_python.Kernel, taichi_python.KernelLaunchContext
    make, launch = kernel.make_launch_context, program.launch_kernel
    setters = {name: getattr(context, name) for name in _SETTERS}

    def making(of: Any) -> Any:
        settings.clear()
        makers[:] = [partial(make, of)]
        return make(of)

    def watched(setter: Callable[..., None]) -> Callable[..., None]:
        def setting(of: Any, *arguments: Any) -> None:
            settings.append((setter, arguments))
            setter(of, *arguments)

        return setting

    def launching(of: Any, compiled: Any, made: Any) -> None:
        seen.append(SeenLaunch(compiled, made, makers[0], settings.copy()))
        launch(of, compiled, made)

    kernel.make_launch_context, program.launch_kernel = making, launching
    for name, setter in setters.items():
        setattr(context, name, watched(setter))
    try:
        yield seen
    finally:
        kernel.make_launch_context, program.launch_kernel = make, launch
        for name, setter in setters.items():
            setattr(context, name, setter)
