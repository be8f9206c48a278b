"""Who works in a process that executes code from outside, and how that process may end.

Nothing in a process sees that a plug-in ends it: ``os._exit``, ``exit`` of a native library,
``execv`` and a signal leave no handler a chance. So the command line works in a child process, and
its parent takes an exit code only from the memory that both share: the child writes it there when
it has seen the explicit end. Before code from outside is imported or called, its name is noted
there as well.
"""

from __future__ import annotations

import ctypes
import importlib
import mmap
import os
import re
import signal
import sys
import sysconfig
import threading
import time
import traceback
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache, wraps
from itertools import islice
from pathlib import Path
from types import CodeType, ModuleType, TracebackType
from typing import Any, Final

from adeye.errors import ASKED_TO_END, AdeyeError, Interrupted, PluginError, Terminated

NOTES_BYTES: Final = 1 << 14
"""Size of the memory in which a process notes who works in it."""

_END, _CODE, _HEARD, _SLOTS, _NAMES = 0, 1, 2, 4, 260
_MOST: Final = 255
"""Threads and plug-ins that are told apart."""
_INCOMPLETE: Final = 3
_RETURNED: Final = 70
_PDEATHSIG: Final = 1  # linux/prctl.h
_ASKING: Final = (signal.SIGINT, signal.SIGTERM)
_LIMITS: Final = (signal.SIGXCPU, signal.SIGXFSZ, signal.SIGKILL)
"""What the system sends to a process that is above a limit."""
_LIMITED: Final = (
    "The system may have ended it, for a limit of time, memory or size of files (ulimit -a; of a "
    "container or a batch queue, too), or somebody has."
)
_SETTLE_S: Final = 0.05
"""After which a signal to the whole group has reached every process of it [s]."""

_HOME: Final = f"{Path(__file__).parent}{os.sep}"
_notes: memoryview = memoryview(bytearray(NOTES_BYTES))
_names: Final[dict[str, int]] = {}
_slots: Final[dict[int, int]] = {}
_entering: Final = threading.RLock()
"""Who comes numbers himself and looks at the folder before anyone else can leave it."""
_inside: Final[set[int]] = set()
"""Threads in which code from outside works."""
_folder = ""
"""Working folder before any of them began; empty if it is gone."""
_worker = 0
_look: Callable[[BaseException], None] | None = None
"""Looks at what code from outside raises, before it is contained."""


def note_in(memory: Any) -> None:
    """Note from now on in some memory who works here.

    Args:
        memory: ``NOTES_BYTES`` bytes that outlive this process.
    """
    global _notes  # noqa: PLW0603 - there is one process
    _notes = memoryview(memory).cast("B")


class guest:  # noqa: N801 - read as `with guest(name):`
    """Code from outside works in here.

    A process that it forked and that would come back from it is ended: it would do everything that
    follows twice. The working folder, which relative paths of the user are meant from, is the same
    afterwards, and so is how numbers are rounded. What it raises is left to who contains it, or is
    turned into ``PluginError``.
    """

    __slots__ = ("_asked", "_former", "_is_loaded", "_kind", "_modules", "_name", "_pid", "_slot")

    def __init__(
        self, name: str, kind: str = "", asked: Any = None, *, is_loaded: bool = True
    ) -> None:
        """Say who comes.

        Args:
            name: The plug-in, as the user wrote it.
            kind: What it is, where nothing else contains what it raises; else empty.
            asked: Its function whose answer is looked at.
            is_loaded: Whether what identifies it is known by now, see ``identified``.
        """
        self._name, self._kind, self._asked = name, kind, asked
        self._is_loaded = is_loaded

    def __enter__(self) -> None:
        self._pid, self._modules = os.getpid(), len(sys.modules)
        with _entering:
            self._slot = _SLOTS + _slots.setdefault(threading.get_ident(), len(_slots) % _MOST)
            self._former = _notes[self._slot]
            if not self._former:
                if not _inside:
                    _remember_folder()
                _inside.add(self._slot)
            _notes[self._slot] = _names.get(self._name) or _number(self._name)

    def __exit__(
        self, _: type[BaseException] | None, error: BaseException | None, __: TracebackType | None
    ) -> None:
        if os.getpid() != self._pid:
            _leave_fork(self._name)
        _notes[self._slot] = self._former
        if not self._former:
            _round_as_usual()
            try:
                _return_to_folder(self._name)
            finally:
                # Not before: who comes meanwhile would take the folder that is left for the usual.
                _inside.discard(self._slot)
        if error is not None:
            raised(error)
        elif self._is_loaded and len(sys.modules) > self._modules:
            require_identified(
                self._name, islice(reversed(sys.modules), len(sys.modules) - self._modules)
            )
        if error is None or not self._kind or isinstance(error, AdeyeError) or is_asked(error):
            return
        raise PluginError(
            f"the {self._kind} {self._name} raised {told(error, self._asked)}"
        ) from error


def watch(look: Callable[[BaseException], None] | None) -> None:
    """Have what code from outside raises looked at before it is contained; None for nobody."""
    global _look  # noqa: PLW0603 - there is one process
    _look = look


def raised(error: BaseException) -> None:
    """Have an exception of code from outside looked at, which is about to be contained."""
    if _look is not None and not is_asked(error):
        _look(error)


def _remember_folder() -> None:
    global _folder  # noqa: PLW0603 - a process has one
    try:
        _folder = os.getcwd()  # noqa: PTH109 - of every call of a guest, so it is to be cheap
    except OSError:  # it was removed, so nothing is found from there anyway
        _folder = ""


def _return_to_folder(name: str) -> None:
    try:
        is_same = os.getcwd() == _folder  # noqa: PTH109 - see above
    except OSError:
        is_same = False
    if not _folder or is_same:
        return
    try:
        os.chdir(_folder)
    except OSError as error:
        raise PluginError(f"{name} left a working folder that is gone: {error}") from error


def _usual_rounding() -> Callable[[], object]:
    """Return what resets rounding and the treatment of tiny numbers (fenv.h), where that is known.

    Libraries change them for a whole thread, so that the same test case would give other bits.
    """
    try:
        reset = ctypes.CDLL("libm.so.6").fesetenv
    except (OSError, AttributeError):
        return lambda: None
    # FE_DFL_ENV of glibc.
    usual = ctypes.c_void_p(-1)
    return lambda: reset(usual)


_round_as_usual: Final = _usual_rounding()


def _number(name: str) -> int:
    number = _names[name] = min(len(_names) + 1, _MOST)
    text = "\n".join(" ".join(item.split()) for item in _names).encode("utf-8", "replace")
    text = text[: NOTES_BYTES - _NAMES]
    _notes[_NAMES : _NAMES + len(text)] = text
    return number


def _leave_fork(name: str) -> None:
    text = f"A process that {name} had forked came back into adeye and was ended.\n"
    os.write(2, text.encode("utf-8", "replace"))
    os._exit(_RETURNED)


def has_guests() -> bool:
    """Tell whether code from outside was imported or called in this process."""
    return bool(_names)


def at_work(memory: Any) -> str:
    """Say which plug-ins were at work in a process that has ended; empty if it had none.

    Args:
        memory: In which it noted them.
    """
    notes = bytes(memoryview(memory).cast("B"))
    names = notes[_NAMES:].rstrip(b"\0").decode("utf-8", "replace").split("\n")
    inside = sorted({names[n - 1] for n in notes[_SLOTS:_NAMES] if 0 < n <= len(names)})
    if inside:
        return f"in the plug-in {' or '.join(inside)}"
    return f"with the plug-ins {', '.join(names)}" if names != [""] else ""


def told(error: BaseException, asked: Any = None) -> str:
    """Say what an exception is and which line raised it.

    Args:
        error: What was raised.
        asked: The function whose answer was refused, if nothing of somebody else raised.
    """
    frame, code = own_frame(error), getattr(asked, "__code__", None)
    place = "" if frame is None else f" ({frame.filename}:{frame.lineno})"
    if isinstance(code, CodeType) and (frame is None or frame.filename.startswith(_HOME)):
        place = f" ({code.co_filename}:{code.co_firstlineno})"
    return f"{type(error).__name__}: {said(error)}{place}"


_masks: Final[list[Callable[[str], str]]] = []
"""Functions that mask secrets in a text."""


def hide(mask: Callable[[str], str]) -> None:
    """Mask secrets in whatever an exception says from now on.

    Args:
        mask: Give a text without them; it is asked when there is one.
    """
    if mask not in _masks:
        _masks.append(mask)


def said(error: BaseException) -> str:
    """Give the text of an exception, whose code may be somebody else's; secrets are masked."""
    try:
        text = str(error)
    except Exception:  # noqa: BLE001 - it is described, not obeyed
        return "it cannot say what it is"
    for mask in _masks:
        text = mask(text)
    return text


def own_frame(error: BaseException) -> traceback.FrameSummary | None:
    """Find the innermost frame of the guest's own files, not of a library that it calls."""
    frames = traceback.extract_tb(error.__traceback__)
    guests = [frame for frame in frames if not frame.filename.startswith(_HOME)]
    home = folder_and_name(guests[0])[0] if guests else ""
    own = [
        frame
        for frame in guests
        if folder_and_name(frame)[0].startswith(home)
        and "site-packages/" not in folder_and_name(frame)[0][len(home) :]
    ]
    return own[-1] if own else frames[-1] if frames else None


def folder_and_name(frame: traceback.FrameSummary) -> tuple[str, str]:
    """Split the file of a frame."""
    folder, slash, name = frame.filename.replace("\\", "/").rpartition("/")
    return folder + slash, name


def is_asked(error: BaseException) -> bool:
    """Tell whether an exception may be somebody's wish to end, and not what a guest raised.

    Signals reach the main thread only, and no process that ignores them. Where the command line
    listens, it raises an exception of its own; elsewhere nobody can tell.
    """
    if not isinstance(error, ASKED_TO_END):
        return False
    handler = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or handler is signal.SIG_IGN:
        return False
    return isinstance(error, Interrupted | Terminated) or handler is signal.default_int_handler


def settle_children(settle: Callable[[], None]) -> None:
    """Have every process that is forked from here settle before a signal can reach it.

    A signal that came first would be lost to the handler that the child has inherited.
    """
    kept = threading.local()

    def hold() -> None:
        kept.mask = signal.pthread_sigmask(signal.SIG_BLOCK, _ASKING)

    def release() -> None:
        signal.pthread_sigmask(signal.SIG_SETMASK, kept.mask)

    def begin() -> None:
        settle()
        release()

    os.register_at_fork(before=hold, after_in_parent=release, after_in_child=begin)


@dataclass(frozen=True, slots=True)
class Ended:
    """How a supervised process ended.

    Attributes:
        code: Exit code to end with.
        text: What is to be said about it; empty for nothing.
    """

    code: int
    text: str = ""


def supervise() -> Ended | None:
    """Go on in a child process; in this one, wait for its end and return it.

    The child gets each SIGINT and SIGTERM that this process gets, once, and dies with it.

    Returns:
        None in the child.
    """
    global _worker  # noqa: PLW0603 - there is one process
    memory, parent = mmap.mmap(-1, NOTES_BYTES), os.getpid()
    # Where somebody ignores the end of children, the system would not keep how they ended.
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {*_ASKING, signal.SIGCHLD})
    pid = os.fork()
    if pid != 0:
        return _ended(_wait(pid, memory), memory)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    if os.getppid() != parent:
        os._exit(_INCOMPLETE)
    note_in(memory)
    _worker = os.getpid()
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)
    return None


def note_end(code: int) -> None:
    """Note the exit code of a supervised process that has seen its explicit end."""
    if _worker and os.getpid() != _worker:
        _leave_fork("a plug-in")
    # The system keeps a byte, of which 256 would be good.
    _notes[_CODE] = code if 0 <= code <= 0xFF else _INCOMPLETE
    _notes[_END] = 1


def note_signal(number: int) -> None:
    """Note that this process has heard SIGINT or SIGTERM, so that it is not passed on again."""
    place = _HEARD + _ASKING.index(signal.Signals(number))
    _notes[place] = (_notes[place] + 1) & 0xFF


def _wait(pid: int, memory: mmap.mmap) -> int:
    """Wait for the end of the child and return its status; pass on what it has not heard itself."""
    known = [0, 0]
    while True:
        number = signal.sigwait({*_ASKING, signal.SIGCHLD})
        if number == signal.SIGCHLD:
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                return status
            continue
        # A terminal sends Ctrl-C to the child, too. One that has it but has not looked at it yet
        # does not get it twice: the system keeps one of each.
        time.sleep(_SETTLE_S)
        place = _ASKING.index(signal.Signals(number))
        heard = memory[_HEARD + place]
        if heard == known[place]:
            os.kill(pid, number)
            heard = (heard + 1) & 0xFF
        known[place] = heard


def _ended(status: int, memory: mmap.mmap) -> Ended:
    code = os.waitstatus_to_exitcode(status)
    if memory[_END]:
        told_code = memory[_CODE]
        # What goes wrong after a good end, such as the last flush, is not good.
        return Ended(told_code or (code if code >= 0 else _INCOMPLETE))
    if -code in _ASKING:
        return Ended(128 - code)
    how = f"code {code}" if code >= 0 else f"signal {-code} ({signal.strsignal(-code)})"
    where = at_work(memory)
    why = "A plug-in returns or raises; it never ends the process."
    if not where:
        why = f"No plug-in was there. {_LIMITED}"
    elif -code in _LIMITS:
        why = f"{_LIMITED} Else a plug-in did, which returns or raises and never ends the process."
    return Ended(
        _INCOMPLETE,
        f"The process ended with {' '.join(filter(None, (how, where)))}, before adeye ended it: "
        f"what it was asked for is incomplete, and a file to write may be as it was before. {why}",
    )


# --- A seal: parts that are judged by read what identifies them, and nothing else -----------------

_identified: Final[set[str]] = set()
"""Places of all files that identify a part which was loaded in this process."""
_refused: Final[dict[str, str]] = {}
"""Parts that imported in this process what is in no identity, and what that is."""
FILES: Final = "adeye_files"
"""What a source calls the list of the files that it reads."""
_INSTALLED: Final = {"site-packages", "dist-packages"}
"""Folders of installed packages, of which the version counts."""
_OWN: Final = f"{os.path.realpath(Path(__file__).parent)}{os.sep}"
_sealed: Final[dict[int, _Seal]] = {}
"""Who works in each thread that may read only what an identity holds."""
_OF_SYSTEM: Final = ("/proc/", "/sys/", "/usr/share/", "/usr/lib/", "/etc/ssl/", "/etc/localtime")
_KEPT_CODE: Final = re.compile(r".*/__pycache__/[^/]+\.nb[ic]")
"""What numba keeps compiled."""
_OPENS: Final = {"open", "ctypes.dlopen"}
"""Events of files that are opened; the first that is told of them is the name."""
_LISTS: Final = {"os.listdir", "os.scandir"}
"""Events of folders that are listed."""
_PLACES: Final = tuple(os.path.realpath(path) for path in sys.path if Path(path).name in _INSTALLED)
"""Where packages are installed, before anybody else may say so."""
_IMPORTS: Final = ("<frozen importlib", f"{sysconfig.get_path('stdlib')}{os.sep}importlib{os.sep}")
"""Who looks for modules, whose sources are compared where they are loaded."""
_THREAD: Final = "_thread.start_new_thread"
_PROCESS: Final = "subprocess.Popen"
# Of what is attached to a database nothing is told.
_LEAVES: Final = {
    *(_THREAD, "_thread.start_joinable_thread"),
    *(_PROCESS, "os.system", "os.posix_spawn", "os.exec", "os.fork", "os.forkpty"),
    *("socket.connect", "sqlite3.connect"),
}
"""Events after which nobody sees what is read."""
_EVENTS: Final = _OPENS | _LISTS | _LEAVES
_UNTOLD: Final = (
    (_THREAD, "_thread", "start_new_thread"),
    (_THREAD, "_thread", "start_new"),
    (_THREAD, "threading", "_start_new_thread"),
    (_PROCESS, "_posixsubprocess", "fork_exec"),
)
"""What begins threads (on Python 3.11) and processes without an event: module and name."""


@contextmanager
def sealed(name: str, known: frozenset[str]) -> Iterator[None]:
    """Let a part read no file that it is not hashed by: its results would be reused.

    Files of the system and of installed packages may be read; threads, processes and connections
    may not be begun. What a native library opens by itself is not seen.

    Args:
        name: The part, as the user wrote it.
        known: Places of the files that it is hashed by; those of other parts are in the identity of
            other results.
    """
    _listen()
    thread = threading.get_ident()
    former = _sealed.get(thread)
    _sealed[thread] = seal = _Seal(name, known)
    try:
        yield
    finally:
        del _sealed[thread]
        if former is not None:
            _sealed[thread] = former
    if seal.broken is not None:  # who goes on without a file goes on without what it says
        raise seal.broken


@contextmanager
def unsealed() -> Iterator[None]:
    """Let somebody who looks into a sealed part read what it may not."""
    thread = threading.get_ident()
    seal = _sealed.pop(thread, None)
    try:
        yield
    finally:
        if seal is not None:
            _sealed[thread] = seal


@dataclass(slots=True)
class _Seal:
    """Who works under it, what that may read, and what was refused first."""

    name: str
    known: frozenset[str]
    broken: PluginError | None = None


@cache
def _listen() -> None:
    """Have Python ask before it opens a file; that cannot be taken back (PEP 578)."""
    sys.addaudithook(_refuse_unknown)
    for event, module, name in _UNTOLD:
        with suppress(ImportError, AttributeError):  # of another system, or of another Python
            place = importlib.import_module(module)
            setattr(place, name, _telling(event, getattr(place, name)))


def _telling(event: str, begin: Callable[..., Any]) -> Callable[..., Any]:
    """Have an event told before something begins."""

    @wraps(begin)
    def tell(*asked: Any) -> Any:
        _refuse_unknown(event, ())
        return begin(*asked)

    return tell


def _refuse_unknown(event: str, arguments: tuple[Any, ...]) -> None:
    if not _sealed or event not in _EVENTS:
        return
    seal = _sealed.get(threading.get_ident())
    said = None if seal is None else _unknown(event, arguments, seal.known)
    if seal is None or said is None:
        return
    error = PluginError(f"{seal.name} {said}")
    seal.broken = seal.broken or error
    raise error


def _unknown(event: str, arguments: tuple[Any, ...], known: frozenset[str]) -> str | None:
    """Say what of an event a sealed part may not do; None if it may."""
    if event in _LEAVES:
        return (
            f"does {event}: what is read then is in no identity. It may compute in its own thread "
            "and process only"
        )
    path = arguments[0]
    if event in _LISTS:
        return _unlisted(path, known)
    if path is None or isinstance(path, int) or path == "":
        return None
    if event == "open" and arguments[2] & os.O_ACCMODE == os.O_WRONLY:
        return None
    place = os.path.realpath(os.fsdecode(path))
    # With a descriptor of a folder a name is of a place that nobody is told of.
    is_hidden = event == "open" and arguments[1] is None and os.fsdecode(path)[:1] != os.sep
    is_there = is_hidden or os.path.isfile(place)  # noqa: PTH113 - for every file that is opened
    if not is_there or _is_known(place, known):
        return None
    return (
        f"reads {place}, which is not in its identity: name it in the source, by a line such as "
        f"{FILES} = [{Path(place).name!r}]"
    )


def _unlisted(path: str | bytes | int | None, known: frozenset[str]) -> str | None:
    """Say that a folder is listed whose files are in no identity; None if it may be."""
    caller = sys._getframe(3).f_code.co_filename
    place = str(path) if isinstance(path, int) else os.path.realpath(os.fsdecode(path or "."))
    if caller.startswith(_IMPORTS) or _is_known(f"{place}{os.sep}", known):
        return None
    return f"lists {place}: which files are there is in no identity. Name those that it reads"


def _is_known(place: str, known: frozenset[str]) -> bool:
    """Tell whether a file is in an identity, of the system, or of an installed package."""
    if place in known or place.startswith((*_OF_SYSTEM, _OWN)) or _KEPT_CODE.fullmatch(place):
        return True
    if place.endswith(".pyc"):  # its source is compared with it where it is loaded
        folder, _, file = place.rpartition("/__pycache__/")
        place = f"{folder}/{file.partition('.')[0]}.py"
    places = (*map(str, _libraries()), *_PLACES)
    return place in known or place.startswith(tuple(f"{path}{os.sep}" for path in places))


def identified(places: Iterable[str]) -> None:
    """Note the places of the files that identify a part."""
    _identified.update(places)


def take_refusal(name: str) -> str | None:
    """Return once what a part was refused for in this process, see ``require_identified``."""
    return _refused.pop(name, None)


def require_identified(
    name: str, modules: Iterable[str], places: Collection[str] = _identified
) -> None:
    """Refuse modules of the user's that a part imported and that identify none.

    What imports by name, as a pickle does, is told by no statement. Once it is imported it is there
    and imported no more, so that the refusal is kept.

    Args:
        name: The part, as the user wrote it.
        modules: Names of what was imported while it worked.
        places: Of the files that identify it; those of all parts of this process.

    Raises:
        PluginError: One is in no identity: results would be reused after an edit of it.
    """
    for module in tuple(modules):
        place = place_of_user(sys.modules.get(module))
        if not place or place in places:
            continue
        _refused[name] = (
            f"{name} imports {module}, which is in no identity: import it in its source, by a "
            f"statement such as import {module.partition('.')[0]}"
        )
        raise PluginError(_refused[name])


def place_of_user(module: ModuleType | None) -> str:
    """Return where a module is that is neither adeye's nor installed; empty for any other."""
    file = getattr(module, "__file__", None)
    place = "" if file is None else os.path.realpath(packed_in(Path(file)))
    return "" if not place or place.startswith(_OWN) or is_installed(Path(place)) else place


def packed_in(path: Path) -> Path:
    """Return the archive that a module is packed into; its own file if it is in none."""
    if path.is_file():
        return path
    return next((file for file in path.parents if file.is_file()), path)


def is_installed(path: Path) -> bool:
    """Tell whether a file is of the standard library or of an installed package."""
    place, known = path.resolve(), (*map(str, _libraries()), *_PLACES)
    return any(place.is_relative_to(folder) for folder in known)


@cache
def _libraries() -> tuple[Path, ...]:
    known = sysconfig.get_paths()
    return tuple(Path(known[name]).resolve() for name in ("stdlib", "platstdlib"))
