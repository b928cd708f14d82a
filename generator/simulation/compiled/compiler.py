"""Compilation by numba with fixed signatures."""

import os
import sys
import tempfile
from collections.abc import Callable, Generator
from contextlib import contextmanager, suppress
from functools import cache
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any, TypeAlias, TypeVar, cast, get_type_hints

import numba as _numba
import numpy as np
from numba import types
from numpy.typing import NDArray

from generator.rotations import Array
from generator.simulation.compiled.code_cache import (
    cache_folder,
    compiling_alone,
    forget_function,
    listeners,
    load_without_registries,
    make_private_folder,
)

numba: Any = _numba
"""numba, whose own types do not describe its options."""

Function = TypeVar("Function", bound=Callable[..., Any])

REAL = types.float64
COUNT = types.int64
FLAG = types.boolean
NOTHING = types.void
TRIPLE = types.UniTuple(types.float64, 3)
QUADRUPLE = types.UniTuple(types.float64, 4)
VECTOR = types.Array(types.float64, 1, "C")
CONSTANT_VECTOR = types.Array(types.float64, 1, "C", readonly=True)
MATRIX = types.Array(types.float64, 2, "C")
STACK = types.Array(types.float64, 3, "C")
INDICES = types.Array(types.int64, 1, "C")
INDEX_TABLE = types.Array(types.int64, 2, "C")

Vector: TypeAlias = Annotated[Array, VECTOR]
Matrix: TypeAlias = Annotated[Array, MATRIX]
Stack: TypeAlias = Annotated[Array, STACK]
Indices: TypeAlias = Annotated[NDArray[np.int64], INDICES]
IndexTable: TypeAlias = Annotated[NDArray[np.int64], INDEX_TABLE]


def compiled_type(fields: type[Any]) -> Any:
    """Return numba's type of a NamedTuple, whose fields are annotated with theirs."""
    hints = get_type_hints(fields, include_extras=True).values()
    return types.NamedTuple([hint.__metadata__[0] for hint in hints], fields)


_RELAXED_ARITHMETIC = {"contract", "reassoc", "arcp", "nsz"}
"""Freedoms of LLVM in floating-point arithmetic; infinities and not-a-number keep their meaning."""

_OPTIONS = {"fastmath": _RELAXED_ARITHMETIC, "error_model": "numpy", "_nrt": False}
"""Options of all functions. None allocates memory, so that numba need not count references to
arrays: that takes a quarter of the time of an evaluation."""


def compiled(
    *signature: Any,
    entry: bool = False,
    pointer: bool = False,
    merged: bool = False,
    vectorised: bool = False,
) -> Callable[[Function], Function]:
    """Compile a function for one signature: the type of the result, then those of the arguments.

    Only an `entry` can be called from Python: to compile the conversion of its arguments takes as
    long as many lines of code. A function with a `pointer` can be an argument of compiled ones; one
    that is called by its name is compiled again with each of its callers. A `merged` one
    becomes part of its callers, which saves passing the tables of a mechanism: some 0.1 us a call.
    Loops over states are `vectorised`. Other threads run while an entry does.
    """
    result, *arguments = signature

    def decorate(function: Function) -> Function:
        for listen in listeners:
            listen(function.__name__.strip("_"))
        with _numba_settings(vectorised=vectorised):
            return cast(
                "Function",
                _compile_or_load(
                    function,
                    result(*arguments),
                    no_cpython_wrapper=not entry,
                    no_cfunc_wrapper=not pointer,
                    nogil=True,
                    forceinline=merged,
                ),
            )

    return decorate


def _compile_or_load(function: Callable[..., Any], signature: Any, **options: Any) -> Any:
    """Compile a function for one signature, or load it from the cache.

    A crash or a full disk may leave a truncated file, on which numba raises errors of various
    types. The file is removed and the function compiled again, without the cache if it cannot be
    stored.
    """
    folder = cache_folder()
    options = {**_OPTIONS, **options}
    if folder is not None:
        for _ in range(2):
            try:
                with compiling_alone(function, folder):
                    made = numba.njit(cache=True, **options)(function)
                    load_without_registries(made)
                    made.compile(signature)
                    made.disable_compile()
                    return made
            except Exception:
                forget_function(function)
    return numba.njit([signature], **options)(function)


def inlined(function: Function) -> Function:
    """Compile a function for the argument types of its compiled callers."""
    return cast(
        "Function",
        numba.njit(**_OPTIONS, forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True)(
            function
        ),
    )


class FunctionPointer(types.WrapperAddressProtocol):
    """Address of a compiled function, which an argument of a compiled function can be.

    numba accepts the function itself as well, but takes three times as long to convert it.
    """

    def __init__(self, function: Any) -> None:
        """Take the address of a function that is compiled for one signature."""
        self.function = function  # keeps its code alive
        (self._signature,) = function.nopython_signatures
        code = function.overloads[self._signature.args]
        self._address = code.library.get_pointer_to_function(code.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        """Return the address."""
        return self._address

    def signature(self) -> Any:
        """Return the numba signature."""
        return self._signature


@cache
def compile_source(source: str, name: str, signature: Any) -> FunctionPointer:
    """Compile the function `name` of generated source text, once in a process.

    numba and LLVM never free a function, so equal sources must share it.

    Args:
        source: text of a module that decorates nothing.
        name: name of the function in it.
        signature: numba signature of the function.
    """
    folder = cache_folder()
    module_name = f"mover_laws_{sha256(source.encode()).hexdigest()[:16]}"
    module = ModuleType(module_name)
    path = f"<{module_name}>"
    if folder is not None:
        path = str(folder / f"{module_name}.py")
        _write_once(Path(path), source)
        module.__file__ = path
    # numba finds the module of what it loads from its cache by this name.
    sys.modules[module_name] = module
    exec(compile(source, path, "exec"), module.__dict__)
    with _numba_settings():
        return FunctionPointer(_compile_or_load(getattr(module, name), signature))


def _write_once(path: Path, text: str) -> None:
    """Write a file unless it is there; a concurrent writer would write the same."""
    with suppress(OSError):
        if path.read_text() == text:
            return
    make_private_folder(path.parent)  # another version may have removed it
    handle, temporary = tempfile.mkstemp(dir=path.parent)
    with os.fdopen(handle, "w") as file:
        file.write(text)
    Path(temporary).replace(path)


@contextmanager
def _numba_settings(*, vectorised: bool = False) -> Generator[None]:
    """Let numba store in `cache_folder` what is compiled within, and optimise it moderately.

    Optimisation of level 1 without vectorised loops takes half the time of numba's level 3, and
    the code is nearly as fast: most of it is straight-line.
    """
    config, folder = numba.config, cache_folder()
    settings = {
        "CACHE_DIR": "" if folder is None else str(folder),
        "OPT": type(config.OPT)(3 if vectorised else 1),
        "LOOP_VECTORIZE": int(vectorised),
    }
    before = {name: getattr(config, name) for name in settings}
    try:
        for name, value in settings.items():
            setattr(config, name, value)
        yield
    finally:
        for name, value in before.items():
            setattr(config, name, value)
