"""Files that are written: never over what is read or kept, and wholly or not at all.

Whoever writes files names them to ``guarded`` before anything is done. Whatever is read meanwhile
says so to ``reads``, and is compared with them: no list of what a verb reads would be complete.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import shutil
import stat
import tempfile
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO, Final

from adeye.errors import PlatformError, SourceLocation, SpecError, UsageError
from adeye.notices import notice

KEPT_FOLDER: Final = ".traces"
"""How the name of a folder of kept traces ends."""
BESIDE_DATABASE: Final = ("-wal", "-shm", "-journal")
"""What SQLite appends to the name of a database for the files that belong to it."""

laid: dict[int, int] = {}
"""Descriptors of this process that mean another one while a verb runs, see ``cli.output``."""

_SOURCES: Final = (".yaml", ".yml", ".py")
_WRITTEN: Final = frozenset(
    {
        "",
        ".bag",
        ".csv",
        ".fmu",
        ".htm",
        ".html",
        ".json",
        ".jsonl",
        ".mcap",
        ".mmd",
        ".npz",
        ".osi",
    }
    | {".parquet", ".reqif", ".sarif", ".sig", ".svg", ".txt", ".xml", ".xodr"}
)
"""Endings of what verbs write; what is there and ends otherwise is something else."""
_PEM: Final = b"-----BEGIN"
Pattern = re.Pattern[bytes]
_BASELINE: Final = re.compile(rb'\s*\{.*"schema":\s*"adeye/baseline@', re.DOTALL)
_SIGNED: Final = re.compile(
    rb'\s*\{.*"(?:schema":\s*"adeye/manifest@|payloadType":\s*"application/vnd\.adeye)', re.DOTALL
)
"""Evidence that is kept and signed: only the verb that writes it may write it anew, as it may a
baseline only that reads it first."""
_OF_OTHERS: Final[Mapping[str, tuple[str, Pattern]]] = {
    "a map": (".xodr", re.compile(rb'.*vendor="adeye"', re.DOTALL)),
    "an FMU": (".fmu", re.compile(rb".{,64}resources/adeye_part\.json", re.DOTALL)),
    "a bag of ROS 1": (".bag", re.compile(rb".*callerid=/adeye_replay", re.DOTALL)),
    "a file of MCAP": (".mcap", re.compile(rb"\x89MCAP.{20}adeye ", re.DOTALL)),
}
"""Kinds of files that others make, too: how they end, and how they begin where adeye wrote them."""
_BINARY: Final = {
    b"PK": "an archive",
    b"PAR1": "a table of Parquet",
    b"#ROSBAG": "a bag of ROS 1",
    b"\x89MCAP": "a file of MCAP",
}
_XML: Final = re.compile(
    rb"(?:\xef\xbb\xbf)?\s*(?:(?:<\?[^>]*>|<!--(?:[^-]|-(?!->))*-->|<![a-z][^>]*>)\s*)*"
    rb"<(?:[\w.-]+:)?([\w.-]+)",
    re.IGNORECASE,
)
_PROMISED: Final = {
    "html": "HTML",
    "junit": "XML of testsuites",
    "sarif": "JSON",
    "json": "JSON",
    "mcap": "a file of MCAP",
    "rosbag": "a bag of ROS 1",
    "xodr": "a map",
}
"""What options write: one whose file is of another kind is refused before anything is done."""
_HEAD_BYTES: Final = 1_000_000
_SQLITE: Final = b"SQLite format 3\0"
_DESCRIPTOR: Final = re.compile(
    r"/dev/std(?P<name>in|out|err)|/(dev|proc/(self|thread-self|(?P<pid>\d+)))/fd/(?P<number>\d+)"
)
_STANDARD: Final = {"in": 0, "out": 1, "err": 2}
_LINKS: Final = 40
_OTHER: Final = "Name another file to write."


class _Guard:
    """Files that are about to be written."""

    def __init__(
        self, files: Mapping[str, Path], taken: Iterable[Path], also_read: str, renewed: str
    ) -> None:
        self.files = files
        self.renewed = [files[renewed]] if renewed in files else []
        self.updated = [files[also_read]] if also_read in files else []
        self.refusal: UsageError | None = None
        self._read: dict[tuple[int, int], str] = {}
        self._new: dict[str, str] = {}
        taken = tuple(taken)
        seen: dict[object, str] = {}
        for name, path in files.items():
            if any(is_same(path, other) or _is_in(other, path) for other in taken):
                raise _refused(name, path, "belongs to the database")
            for other, folder in files.items():
                if _is_in(path, folder) and not is_stream(path):
                    raise UsageError(
                        f"{name} {str(path)!r} is in the folder of {other}, which is replaced",
                        remedy="Name a place beside it.",
                    )
            require_replaceable(path, name, known=self.known(path))
            found = _stat(path)
            key: object = descriptor_of(path) or _spelling(path)
            if found is not None and not stat.S_ISCHR(found.st_mode):
                key = inode = found.st_dev, found.st_ino
                if name != also_read:
                    self._read[inode] = name
            elif found is None:
                self._new[_spelling(path)] = name
            if seen.setdefault(key, name) != name and not (found and stat.S_ISCHR(found.st_mode)):
                raise _one_file(seen[key], name, path)

    def known(self, path: Path) -> list[Pattern]:
        """List the kinds of evidence that may be written anew there."""
        kinds = (_BASELINE, self.updated), (_SIGNED, self.renewed)
        return [kind for kind, paths in kinds if any(is_same(path, item) for item in paths)]

    def reads(self, path: Path, option: str) -> None:
        """Compare a file that is read with those that are about to be written."""
        found = _stat(path)
        if found is None and option and (name := self._new.get(_spelling(path))):
            self.refusal = _one_file(name, option, self.files[name])
        elif found is not None and (name := self._read.get((found.st_dev, found.st_ino))):
            self.refusal = _refused(name, self.files[name], "is what is read")
        else:
            return
        raise self.refusal


_guards: ContextVar[tuple[_Guard, ...]] = ContextVar("guards", default=())


@contextlib.contextmanager
def guarded(
    files: Mapping[str, Path | None],
    *,
    taken: Iterable[Path] = (),
    also_read: str = "",
    renewed: str = "",
) -> Iterator[None]:
    """Refuse files that are not to be written over, before anything is done.

    Those that are there and that nobody has written at the end are told: they are of before.

    Args:
        files: What is about to be written, by the name of its option.
        taken: What must not be written, whether it is there or not.
        also_read: Option whose file is brought up to date: it is read before it is written.
        renewed: Option whose file may be evidence of an earlier time, which is written anew.

    Raises:
        UsageError: One of them is taken, is another of them, holds what must not be lost, or, from
            then on, is what is read.
    """
    asked = {name: path for name, path in files.items() if path is not None}
    guard = _Guard(asked, taken, also_read, renewed)
    token = _guards.set((*_guards.get(), guard))
    before = {path: _state(path) for path in asked.values() if path.is_file()}
    try:
        yield
    finally:
        _guards.reset(token)
        kept = [str(path) for path, state in before.items() if _state(path) == state]
        if kept and guard.refusal is None:
            notice(f"not written: what is in {' and '.join(kept)} is of before")


def are_guarded(paths: Collection[Path]) -> bool:
    """Tell whether somebody named all these files, each once, to ``guarded`` already."""
    known = {path for guard in _guards.get() for path in guard.files.values()}
    return len(set(paths)) == len(paths) and known.issuperset(paths)


def reads(path: str | Path, option: str = "") -> None:
    """Say that a file is an input; to be called by whatever opens one.

    Args:
        path: Of the file.
        option: What names it, if it means a file though none may be there: a verb may make it.

    Raises:
        UsageError: It is about to be written.
    """
    for guard in _guards.get():
        guard.reads(Path(path), option)


def require_plain(path: Path, most: float = math.inf) -> None:
    """Refuse what should not be read whole: devices and pipes may never end.

    Args:
        path: What somebody named.
        most: Largest size that is read [bytes]; that of what is not read whole has no limit.

    Raises:
        SpecError: It is no regular file, or larger.
        UsageError: It is about to be written.
        OSError: It is not there.
    """
    where = SourceLocation(str(path), 1, 1)
    try:
        reads(path)
        found = path.stat()
    except ValueError as error:
        # NUL, or half of a character.
        raise SpecError("no file has such a name", where=where, remedy="Name a file.") from error
    if stat.S_ISDIR(found.st_mode):
        raise SpecError("this is a folder, not a file", where=where, remedy="Name a file.")
    if not stat.S_ISREG(found.st_mode):
        raise SpecError("this is not a regular file", where=where, remedy="Name a file.")
    if found.st_size > most:
        raise SpecError(f"the file has more than {most:,} bytes", where=where, remedy="Split it.")


def require_unread() -> None:
    """Refuse to go on if what is about to be written was read, whoever passed over that.

    Raises:
        UsageError: See ``reads``.
    """
    for guard in _guards.get():
        if guard.refusal is not None:
            raise guard.refusal


def is_same(one: Path, other: Path) -> bool:
    """Tell whether two paths are one file, by whatever link or spelling."""
    found, known = _stat(one), _stat(other)
    if found is not None and known is not None:
        return os.path.samestat(found, known)
    # What is not there yet may still be one file, where the file system knows no case.
    return _spelling(one) == _spelling(other)


def _is_in(path: Path, folder: Path) -> bool:
    """Tell whether a path leads into a folder, whether any of it is there or not."""
    return any(is_same(above, folder) for above in Path(os.path.realpath(path)).parents)


def require_replaceable(path: Path, name: str = "", *, known: Collection[Pattern] = ()) -> None:
    """Refuse to put a file where something is that must not be lost.

    Args:
        path: Of the file.
        name: Of its option, for the message.
        known: Evidence that the same verb wrote before, by its beginning.

    Raises:
        UsageError: A database, a kept trace, a source of a plan, evidence, a key, a device, or what
            no verb writes is there.
    """
    if is_stream(path):
        return
    home, *below = path.parts or ("",)
    if home.startswith("~") and below and not os.path.lexists(home):
        raise UsageError(
            f"{name or 'file'} {str(path)!r} begins with a home that no shell put in",
            remedy="Write $HOME for ~, or the folder.",
        )
    real = Path(os.path.realpath(path))
    if KEPT_FOLDER in {real.suffix, real.parent.suffix}:
        raise _refused(name, path, "is a place of kept traces")
    for end in BESIDE_DATABASE:
        if real.name.endswith(end) and _is_database(Path(str(real).removesuffix(end))):
            raise _refused(name, path, "belongs to a database")
    found = _stat(path)
    if found is None:
        return
    if stat.S_ISDIR(found.st_mode):
        # It may be replaced by a folder, and the file system replaces it by nothing else.
        return
    if not stat.S_ISREG(found.st_mode):
        raise UsageError(f"{name or 'file'} {str(path)!r} is no regular file", remedy=_OTHER)
    if why := _worth(real.suffix.lower(), head := _head(path), known):
        raise _refused(name, path, why)
    _require_kind(path, name, head, _PROMISED.get(name.removeprefix("--"), ""))


def _require_kind(path: Path, name: str, head: bytes, written: str) -> None:
    """Refuse to put a kind of content in the place of another one; what is empty is of none."""
    if head and written and (kind := _kind(head)) != written:
        raise _refused(name, path, f"is {kind}, where {written} is written")


def _kind(head: bytes) -> str:
    """Tell what a file holds, by its beginning."""
    for begin, kind in _BINARY.items():
        if head.startswith(begin):
            is_fmu = _OF_OTHERS["an FMU"][1].match(head) or b"modelDescription.xml" in head
            return "an FMU" if kind == "an archive" and is_fmu else kind
    if found := _XML.match(head):
        root = found[1].decode("ascii", "replace").lower()
        return {"opendrive": "a map", "html": "HTML"}.get(root, f"XML of {root}")
    return "JSON" if head.lstrip()[:1] in {b"{", b"["} else "text"


def _worth(ending: str, head: bytes, known: Collection[Pattern]) -> str:
    """Tell why a file must not be lost, by its ending and its beginning; nothing if it may be."""
    is_of = _kind(head)
    kinds = (
        (head.startswith(_SQLITE), "is a database"),
        (ending in _SOURCES, "is a source of plans or plug-ins"),
        (head.startswith(_PEM), "is a key or a certificate"),
        (
            any(item not in known and item.match(head) for item in (_BASELINE, _SIGNED)),
            "is a baseline, a manifest or a signature",
        ),
        *(
            (
                (ending == end or is_of == kind) and own.match(head) is None,
                f"is {kind} that adeye has not written",
            )
            for kind, (end, own) in _OF_OTHERS.items()
        ),
        (ending not in _WRITTEN, "is there and has an ending that adeye never writes"),
    )
    return next((why for is_so, why in kinds if is_so), "") if head else ""


def has_mark(path: Path) -> bool:
    """Tell whether a file is of a kind that others make, too, and adeye has written it."""
    return any(own.match(_head(path)) for _, own in _OF_OTHERS.values())


def descriptor_of(path: Path) -> int | None:
    """Give the descriptor that a path such as ``/dev/stdout`` stands for, also by links to it."""
    text = os.path.abspath(path)  # noqa: PTH100 - resolve() would follow the link of a descriptor
    for _ in range(_LINKS):
        found = _DESCRIPTOR.fullmatch(text)
        if found is not None and found["pid"] in {None, str(os.getpid())}:
            number = found["number"]
            given = _STANDARD[found["name"]] if number is None else int(number)
            return laid.get(given, given)
        try:
            text = os.path.normpath(Path(text).parent / Path(text).readlink())
        except (OSError, ValueError):
            return None
    return None


def is_stream(path: Path) -> bool:
    """Tell whether what is written there goes somewhere else: to a pipe or a terminal."""
    found = _stat(path)
    is_one = found is not None and (stat.S_ISFIFO(found.st_mode) or stat.S_ISCHR(found.st_mode))
    return is_one or descriptor_of(path) is not None


def _refused(name: str, path: Path, why: str) -> UsageError:
    return UsageError(
        f"{name} {str(path)!r} {why}, and would be overwritten".strip(), remedy=_OTHER
    )


def _one_file(one: str, other: str, path: Path) -> UsageError:
    return UsageError(
        f"{one} and {other} are one file, {str(path)!r}", remedy="Give each a file of its own."
    )


def _stat(path: Path) -> os.stat_result | None:
    try:
        return path.stat()
    except (OSError, ValueError):
        return None


def _state(path: Path) -> tuple[int, ...]:
    found = _stat(path)
    return () if found is None else (found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns)


def _spelling(path: Path) -> str:
    return unicodedata.normalize("NFC", os.path.realpath(path)).casefold()


def _is_database(path: Path) -> bool:
    return _head(path, len(_SQLITE)) == _SQLITE


def _head(path: Path, size: int = _HEAD_BYTES) -> bytes:
    """Give the beginning of a file; of what cannot be read, nothing."""
    try:
        # Whoever opens a pipe to look into it waits for its other end.
        if not path.is_file():
            return b""
        with path.open("rb") as stream:
            return stream.read(size)
    except (OSError, ValueError):
        return b""


def write_atomically(content: bytes, path: Path) -> None:
    """Write a file beside its place and move it there; missing folders are made.

    Args:
        content: Everything that the file holds.
        path: Where to.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    with replacing(path) as temporary, temporary.open("wb") as file:
        file.write(content)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a place beside a file to write to; what stands there at the end becomes the file.

    Args:
        path: Of the file; missing folders are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    _require_free(path)
    if is_stream(path):
        with _into_stream(path) as temporary:
            yield temporary
        return
    path = Path(os.path.realpath(path))  # a link stays, and leads to what is new
    temporary = _beside(path)
    try:
        with _refusals_in_words(path):
            path.parent.mkdir(parents=True, exist_ok=True)
            yield temporary
            _require_kind(path, "", _head(path), _kind(_head(temporary)))
            _sync(temporary)
            temporary.replace(path)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def replacing_folder(path: Path) -> Iterator[Path]:
    """Give an empty folder beside a folder; with what it holds at the end it takes its place.

    Args:
        path: Of the folder; missing ones above it are made. A link stays, and leads to what is new.

    Raises:
        UsageError: Something is there that is no folder: a file, a device, a pipe.
        PlatformError: The file system refused; what was there before still is.
    """
    _require_free(path)
    if path.exists() and not path.is_dir():
        raise UsageError(
            f"{str(path)!r} is no folder", remedy="Name a folder, or one that is not there yet."
        )
    path = Path(os.path.realpath(path)) if path.is_symlink() else path
    temporary, former = _beside(path), _beside(path, "former")
    try:
        with _refusals_in_words(path):
            temporary.mkdir(parents=True)
            yield temporary
            for file in sorted(temporary.iterdir()):
                _sync(file)
            if path.exists():
                path.replace(former)
            try:
                temporary.replace(path)
            except OSError:
                if former.exists():
                    former.replace(path)
                raise
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        # If it could neither be replaced nor put back, it is all that there is.
        if path.exists():
            shutil.rmtree(former, ignore_errors=True)


def _require_free(path: Path) -> None:
    require_unread()
    require_replaceable(path, known=[item for guard in _guards.get() for item in guard.known(path)])


@contextlib.contextmanager
def _into_stream(path: Path) -> Iterator[Path]:
    """Give a place whose content goes where a path leads to; what is there is not replaced."""
    with tempfile.TemporaryDirectory() as folder:
        temporary = Path(folder) / path.name
        yield temporary
        with (
            _refusals_in_words(path),
            temporary.open("rb") as content,
            _open_stream(path) as stream,
        ):
            shutil.copyfileobj(content, stream)


def _open_stream(path: Path) -> BinaryIO:
    number = descriptor_of(path)
    # By its path a redirected output would be opened anew, and written from its beginning.
    return path.open("wb") if number is None else open(os.dup(number), "wb")  # noqa: PTH123


def _beside(path: Path, end: str = "part") -> Path:
    # One process writes one file of a name at a time, so its number keeps writers apart.
    return path.with_name(f".{path.name}.{os.getpid()}.{end}")


def _sync(path: Path) -> None:
    """Wait until the disk has a file."""
    with path.open("rb") as file:
        os.fsync(file.fileno())


@contextlib.contextmanager
def _refusals_in_words(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        msg = f"cannot write {path}: {error.strerror or error}. Check the folder and its rights."
        raise PlatformError(msg) from error
