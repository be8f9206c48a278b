"""How numba compiles kernels: what only other kernels call gets no machine code of its own.

A kernel that Python calls carries all that it calls with it, so numba's ways of making each of
them callable from Python and executable for itself are half of the time that compiling takes. What
is relied on beyond numba's public extension points is listed in the tests of this module.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

try:
    import fcntl
except ImportError:  # pragma: no cover - there is none on Windows
    fcntl = None  # type: ignore[assignment]

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags, compile_extra
from numba.core.errors import TypingError
from numba.core.postproc import PostProcessor, VariableLifetime
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.core.targetconfig import ConfigStack
from numba.core.transforms import canonicalize_cfg
from numba.core.types import Array
from numba.core.types.containers import BaseTuple
from numba.core.types.functions import Function
from numba.core.types.misc import unliteral
from numba.core.typing import make_concrete_template


class _Options(Flags):  # type: ignore[misc]
    """Options of the compiler that do not change.

    Numba compares them whenever it looks an operation up; one object for equal options spares it
    the comparison of all of them.
    """

    __slots__ = ()
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def copy(self) -> Flags:
        """Return what holds for the functions that numba itself compiles for this one.

        Numba changes it, so it is a new object each time.
        """
        plain = _Inherited(self)
        for name in ("forceinline", "no_compile", "no_cpython_wrapper"):
            setattr(plain, name, False)
        return plain


_options = cache(_Options)


class _Inherited(Flags):  # type: ignore[misc]
    """Options of what numba compiles for a kernel, compared by what is set and not by all."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Inherited) and self._values == other._values

    def __hash__(self) -> int:
        return hash(frozenset(self._values))


def _our_options() -> _Options | _Inherited | None:
    """Return the options of what is compiled now, None if it is somebody else's."""
    options = ConfigStack.top_or_none()
    return options if isinstance(options, _Options | _Inherited) else None


def _remembered(plain: Any) -> Any:
    """Look what a built-in function returns for some types up once.

    Numba tries all that ``+`` may mean at each place where it stands.
    """

    def get_call_type(self: Any, context: Any, args: Any, kws: Any) -> Any:
        if (options := _our_options()) is None:
            return plain(self, context, args, kws)
        known = self.__dict__.setdefault("_adeye_known", {})
        key = (context, tuple(args), tuple(kws.items()), options)
        found = known.get(key)
        if found is None:
            found = known[key] = plain(self, context, args, kws)
        return found

    return get_call_type


def _without_entries(plain: Any) -> Any:
    """Leave out which variables live where a block begins; generators and Python code ask for it.

    Numba works it out anew after each of its passes.
    """

    def run(self: Any, emit_dels: Any = None, **options: Any) -> None:
        function = self.func_ir
        if emit_dels or function.is_generator or _our_options() is None:
            plain(self, bool(emit_dels), **options)
            return
        function.blocks = canonicalize_cfg(function.blocks)
        function.variable_lifetime = VariableLifetime(function.blocks)
        function.generator_info = None

    return run


Function.get_call_type = _remembered(Function.get_call_type)  # type: ignore[method-assign]
PostProcessor.run = _without_entries(PostProcessor.run)


class _Library(JITCodeLibrary):  # type: ignore[misc]
    """The code of one kernel and of all that it calls, optimised once.

    Numba optimises each function alone, then all of them a little to find pairs of reference
    counts, and then in earnest, which is enough here.
    """

    def _optimize_functions(self, module: Any) -> None:
        module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)

    def finalize(self) -> None:
        """Link all that is called, once and after its callers: what nobody asks for is left out."""
        self._linking_libraries = [*_callees_first(self, set())][::-1]
        super().finalize()


class _LinkedLibrary(_Library):
    """Code that is linked into a kernel for Python, and optimised and translated there."""

    def finalize(self) -> None:
        """Leave what is called to be linked there, too."""
        self._finalized = True


def _callees_first(library: Any, known: set[Any]) -> Iterator[Any]:
    for called in library._linking_libraries:
        if called not in known:
            known.add(called)
            # What numba compiled itself holds all that it calls.
            if isinstance(called, _LinkedLibrary):
                yield from _callees_first(called, known)
            yield called


class _Compiler(Compiler):  # type: ignore[misc]
    """Numba's passes, with this module's library and options."""

    library = _Library

    def __init__(
        self,
        typing: Any,
        target: Any,
        _library: None,
        args: Any,
        return_type: Any,
        flags: Flags,
        local: Any,
    ) -> None:
        library = self.library(target.codegen(), "kernel")
        library.enable_object_caching()
        super().__init__(typing, target, library, args, return_type, _options(flags), local)


class _LinkedCompiler(_Compiler):
    library = _LinkedLibrary


@contextmanager
def _alone(folder: str | None, name: str) -> Iterator[None]:
    """Let one process at a time compile a function; the next one finds it in the cache."""
    file = None
    if folder is not None and fcntl is not None:
        with suppress(OSError):
            Path(folder).mkdir(parents=True, exist_ok=True)
            file = (Path(folder) / f"{name}.lock").open("a")
    if file is None:
        yield
        return
    with file:
        # A folder on a network may know no locks; then the work is done twice.
        with suppress(OSError):
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _refuse_arrays(name: str, returned: Any) -> None:
    """Refuse what a kernel returns to one that counts views, which would give them back twice."""
    if isinstance(returned, Array):
        raise TypingError(f"{name} returns an array uncounted: an allocating kernel cannot take it")
    for item in returned if isinstance(returned, BaseTuple) else ():
        _refuse_arrays(name, item)


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """A function that is compiled for Python when Python calls it, and for kernels when they do."""

    def __init__(self, py_func: Any, locals: Any = None, targetoptions: Any = None) -> None:
        super().__init__(py_func, locals, targetoptions, _Compiler)
        self._linked: dict[tuple[Any, ...], Any] = {}

    def compile(self, sig: Any) -> Any:
        """Load the function, or compile it while no other process does."""
        with _alone(getattr(self._cache, "cache_path", None), self.py_func.__qualname__):
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Compile what a calling kernel links, unless it is there, and tell its signature."""
        pysig, folded = self.fold_argument_types(args, kws)
        # To pass the literal 0 takes no function of its own.
        key = tuple(unliteral(one) for one in folded)
        if key not in self._linked:
            self._linked[key] = self._link(key)
        name = self.py_func.__name__
        signatures = [self._linked[key].signature]
        caller = _our_options()
        if caller is not None and caller.nrt and not self.targetoptions["_nrt"]:
            _refuse_arrays(name, signatures[0].return_type)
        return make_concrete_template(name, name, signatures), pysig, key, {}

    def get_overload(self, sig: Any) -> Any:
        """Return the key under which a calling kernel finds what it links."""
        args, _ = normalize_signature(sig)
        return self._linked[tuple(args)].entry_point

    def _link(self, args: tuple[Any, ...]) -> Any:
        flags = Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        flags.no_compile = flags.no_cpython_wrapper = True
        typing, target = self.typingctx, self.targetctx
        # Tells numba that a call of itself is a recursion.
        with self._compiling_counter:
            result = compile_extra(
                typing, target, self.py_func, args, None, flags, {}, pipeline_class=_LinkedCompiler
            )._replace(entry_point=object())
        target.insert_user_function(result.entry_point, result.fndesc, [result.library])
        return result
