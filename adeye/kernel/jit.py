"""The one door to the compiler: a typed decorator and a cache folder that cannot be stale.

The compiler itself is imported when the first kernel is called, or asked for: what only reads
results, or plans, does without it. From then on every kernel is what numba makes of it.
"""

from __future__ import annotations

import hashlib
import os
import platform
import stat
import tempfile
from collections.abc import Callable
from contextlib import suppress
from functools import cache, update_wrapper
from importlib.metadata import version
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any, Final, ParamSpec, TypeVar, cast

if TYPE_CHECKING:
    from types import ModuleType

P = ParamSpec("P")
R = TypeVar("R")

_PACKAGE = Path(__file__).parent.parent
_VARIABLE = "NUMBA_CACHE_DIR"
# Remembers which folder was chosen here, so that a child process does not take the folder that it
# inherits, named after older sources, for a wish of the user.
_CHOSEN = "ADEYE_NUMBA_CACHE_DIR"


@cache
def source_digest() -> str:
    """Return the digest of everything that decides what the compiler makes, 24 hex digits.

    Numba stamps a compiled function with its own file only and inlines what it calls from others,
    so the digest covers every source file of the package that imports this module and the whole of
    ``adeye.kernel``, with the versions of Python, numba and llvmlite.
    """
    package = _PACKAGE.resolve()
    digest = hashlib.sha256()
    for tool in ("numba", "llvmlite", "numpy"):
        digest.update(f"{tool} {version(tool)}\n".encode())
    digest.update(f"python {platform.python_version()}\n".encode())
    for path in sorted(package.rglob("*.py")):
        content = path.read_bytes()
        if b"kernel.jit" in content or "kernel" in path.relative_to(package).parts:
            name = path.relative_to(package).as_posix()
            digest.update(f"{name} {len(content)}\n".encode())
            digest.update(content)
    return digest.hexdigest()[:24]


def _cache_root() -> Path | None:
    """Return the user's cache folder for compiled code; None without a home."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    if Path(base).is_absolute():
        return Path(base) / "adeye" / "numba"
    try:
        return Path.home() / ".cache" / "adeye" / "numba"
    except RuntimeError:
        return None


def _is_private(folder: Path) -> bool:
    """Tell whether only this user can write to the folder; what it holds is executed."""
    status = folder.lstat()
    owned = not hasattr(os, "getuid") or status.st_uid == os.getuid()
    return stat.S_ISDIR(status.st_mode) and owned and not status.st_mode & 0o022


def _usable(folder: Path) -> bool:
    """Create the folder and tell whether a file can be written to it."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _choose_directory() -> Path:
    root = _cache_root()
    if root is not None and _usable(root / source_digest()):
        return root / source_digest()
    owner = os.getuid() if hasattr(os, "getuid") else "user"
    shared = Path(tempfile.gettempdir()) / f"adeye-numba-{owner}"
    if _usable(shared) and _is_private(shared) and _usable(shared / source_digest()):
        return shared / source_digest()
    return Path(tempfile.mkdtemp(prefix="adeye-numba-"))


def _point_numba_at_cache() -> Path:
    """Set the cache folder in the environment, unless the user did, and return it."""
    asked = os.environ.get(_VARIABLE)
    if asked and asked != os.environ.get(_CHOSEN):
        return Path(asked)
    chosen = _choose_directory()
    os.environ[_VARIABLE] = os.environ[_CHOSEN] = str(chosen)
    return chosen


_OPTIONS = {
    "nopython": True,
    "fastmath": False,
    "error_model": "numpy",
    "boundscheck": False,
    "nogil": True,
    # Nobody calls a kernel from C.
    "no_cfunc_wrapper": True,
    # Without its own word, a function that is first met in an inlined one is inlined too.
    "forceinline": False,
    "_nrt": False,
}


@cache
def cache_directory() -> Path:
    """Return the folder that holds the compiled functions of these sources.

    It is fixed for the life of the process, before numba reads it.
    """
    return _point_numba_at_cache()


def is_cache_warm(*parts: str) -> bool:
    """Tell whether a test case was executed with the compiled functions of these sources before.

    Without them, the first run compiles for half a minute. With ``NUMBA_DISABLE_JIT`` nothing is
    ever compiled, which counts as warm.

    Args:
        parts: Names of what is only compiled where it is used, such as a kind of sensor.
    """
    return bool(compiler().config.DISABLE_JIT) or all(_mark(part).exists() for part in ("", *parts))


def mark_cache_warm(*parts: str) -> None:
    """Note that compiled functions of these sources are stored; a folder may refuse the note.

    Args:
        parts: Which of those that are only compiled where they are used are among them.
    """
    for part in ("", *parts):
        with suppress(OSError):
            _mark(part).touch()


@cache
def _mark(part: str) -> Path:
    # A folder that the user chose serves several versions of the sources.
    ending = f"-{part.replace('/', '_')}" if part else ""
    return cache_directory() / f"warm-{source_digest()}{ending}"


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function of numbers and arrays on its first call, and keep the machine code.

    That of a function from outside of adeye is kept while the process lives, not on disk: it may
    hold numbers of modules and files that have changed since.

    Arithmetic is IEEE 754 in the order written: no reassociation, no contraction, no parallel
    reduction, so the same bits come out of every processor. Division by zero gives infinity or
    NaN when compiled but raises in plain Python, so a kernel tests its divisors. The interpreter
    lock is released.

    A function may call itself, but two cannot call each other.

    Views of arrays are not counted, which saves a quarter of the time of small functions; so it
    cannot make arrays: one that does is ``allocating``.

    >>> @compiled
    ... def doubled(x: float) -> float:
    ...     return 2.0 * x
    >>> doubled(1.5)
    3.0
    """
    return _compiled(function)


def allocating(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a function that makes arrays; in everything else like ``compiled``.

    It counts what ``compiled`` ones do not, so it cannot take an array from one, bare or in a
    tuple: it would give back what was never counted, and memory that is in use would be freed.
    """
    return _compiled(function, _nrt=True)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile a small function into every one that calls it; in everything else like ``compiled``.

    Handing an array over takes ten machine words, more than many a small function does with it.
    """
    return _compiled(function, forceinline=True)


# --- The compiler, when it is needed --------------------------------------------------------------

_lock: Final = RLock()
_waiting: Final[list[_Deferred]] = []
"""Kernels of modules that were imported before the compiler."""
_loaded: Final[list[ModuleType]] = []


class _Deferred:
    """A kernel whose compiler was not loaded yet; from then on it hands everything on to it."""

    def __init__(self, function: Callable[..., Any], options: dict[str, bool]) -> None:
        update_wrapper(self, function)
        self._options = options
        self.kernel: Callable[..., Any] = self._first

    def __call__(self, *args: Any, **named: Any) -> Any:
        """Call the kernel."""
        return self.kernel(*args, **named)

    def __getattr__(self, name: str) -> Any:
        """Return what numba knows of the kernel."""
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.settled(), name)

    def __reduce__(self) -> str:
        """Let other processes find it by its name, as a function."""
        return str(self.__dict__["__qualname__"])

    def _first(self, *args: Any, **named: Any) -> Any:
        return self.settled()(*args, **named)

    def settled(self) -> Callable[..., Any]:
        """Return the kernel."""
        compiler()
        return self.kernel

    def settle(self) -> None:
        """Make the kernel."""
        self.kernel = _kernel(self.__dict__["__wrapped__"], self._options)


def compiler() -> ModuleType:
    """Load numba unless it is, with the kernels of all that was imported before.

    Who drives runs calls it first: inside of a plug-in's turn, no file may be read.
    """
    if _loaded and not _waiting:
        return _loaded[0]
    with _lock:
        if not _loaded:
            cache_directory()
            import numba
            from numba.extending import typeof_impl

            # Somebody else may have imported numba before.
            numba.config.reload_config()
            # To kernels that name it, it is the kernel.
            typeof_impl.register(_Deferred, lambda known, at: typeof_impl(known.settled(), at))
            _loaded.append(numba)
        while _waiting:
            _waiting[-1].settle()
            _waiting.pop()
        return _loaded[0]


def _compiled(function: Callable[P, R], **options: bool) -> Callable[P, R]:
    if _loaded:
        return cast("Callable[P, R]", _kernel(function, options))
    known = _Deferred(function, options)
    _waiting.append(known)
    return cast("Callable[P, R]", known)


def _kernel(function: Callable[..., Any], options: dict[str, bool]) -> Callable[..., Any]:
    if _loaded[0].config.DISABLE_JIT:
        return function
    from adeye.kernel.linking import Kernel

    kernel = Kernel(function, targetoptions={**_OPTIONS, **options})
    # The folder is named after the sources of the package: of others, nothing tells what went in.
    if Path(function.__code__.co_filename).is_relative_to(_PACKAGE):
        kernel.enable_caching()
    return cast("Callable[..., Any]", kernel)
