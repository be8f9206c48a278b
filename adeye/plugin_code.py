"""The code behind a part from outside: its files, their hash, and whether these are executed.

A result names the code that made it by the files that hold it. So all of them are hashed, those of
the modules that a part imports included where they are the user's own, and a process that holds an
older state of one in memory is refused.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import os
import re
import struct
import sys
import time
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, lru_cache
from glob import escape
from importlib.machinery import ModuleSpec, SourceFileLoader, all_suffixes
from importlib.metadata import distribution, packages_distributions, requires
from pathlib import Path
from types import ModuleType
from typing import Any, Final

from adeye.errors import SourceLocation, SpecError
from adeye.identity import Held, file_digest, variables_of
from adeye.outputs import reads
from adeye.supervision import FILES, guest, is_installed, packed_in

File = tuple[str, Path]
"""A file with the label that it is hashed with, which does not hang on where it lies."""

_EXECUTED: Final[dict[str, str]] = {}
"""Hash of the source that each module of a plug-in's package was executed from."""
_LOOKED: Final[dict[str, float]] = {}
"""When the modules of each such package were last compared with their files [s since 1970]."""
_NAMED: Final[dict[str, str]] = {}
"""Hash of each file of data as it was when a part that reads it was first loaded, by its place."""
_HELD: Final[set[str]] = set()
"""Places of files that were another one while code was executed here: it may have kept that."""
_BESIDE: Final[dict[str, tuple[str, str]]] = {}
"""Where each module lies that a part imports by name, and its hash."""
_HANDED: Final[dict[str, tuple[dict[str, str], dict[str, frozenset[str]]]]] = {}
"""By module: who reads which data, and what the sealed parts that share it are hashed by."""
_SHARED: Final[dict[tuple[str, str], dict[str, dict[str, Held]]]] = {}
"""What each part left in the variables of a module of the user's when it was first loaded from it,
by name and hash of the module's file."""
_AS_WRITTEN: Final[dict[tuple[str, str], dict[str, Held]]] = {}
"""The variables of such a module as its source alone makes them."""
_USED: Final = ContextVar[set[tuple[str, str]]]("_USED")
"""The modules of the parts that were loaded in a ``settings_kept``, by name and hash."""
_ANYTHING: Final = Held(is_plain=False, told="?")
NAMES: Final = ">"
"""Between a source and a file that it names, in the label of that."""
_HERE: Final = "./"
"""Before the label of what a source may import by name."""
_ANEW: Final = "Start again in a new process (a notebook: a new kernel)."
_PART_BYTES: Final = 1 << 20
"""What is read at once: a package may hold the weights of a network."""
_STARTED: Final = 19
"""Place of the start behind the name in ``/proc/self/stat`` [ticks since boot] (proc(5))."""


def package_files(folders: Iterable[Path]) -> list[File]:
    """List the files of a package: sources, native libraries and data.

    What Python keeps compiled and what is hidden is left out; links are followed.
    """
    found: list[File] = []
    for folder in folders:
        entered: set[str] = set()
        for place, below, names in os.walk(folder, followlinks=True):
            entered.add(os.path.realpath(place))
            below[:] = [
                name
                for name in below
                if name != "__pycache__"
                and not name.startswith(".")
                and os.path.realpath(Path(place, name)) not in entered
            ]
            paths = (Path(place, name) for name in names if not name.startswith("."))
            found += (
                (path.relative_to(folder).as_posix(), path) for path in paths if path.is_file()
            )
    return sorted(found)


def files_digest(files: Iterable[File]) -> str:
    """Hash files with their labels."""
    digest = hashlib.sha256()
    for label, path in files:
        reads(path)
        with path.open("rb") as stream:
            digest.update(f"{label} {os.fstat(stream.fileno()).st_size}\n".encode())
            while part := stream.read(_PART_BYTES):
                digest.update(part)
    return digest.hexdigest()


def code_digest(files: Sequence[File], *, is_file: bool) -> str:
    """Hash the code of a part: of one that is named by its file, and imports none, just that."""
    if is_file and len(files) == 1:
        reads(files[0][1])
        return file_digest(files[0][1])
    return files_digest(files)


def places_of(files: Iterable[File]) -> frozenset[str]:
    """Give the places of files without links: what a part that they identify may read."""
    return frozenset(os.path.realpath(path) for _, path in files)


def places_of_package(package: str) -> frozenset[str]:
    """Give the places of the files of a package and of what it imports, before it is imported.

    Args:
        package: Name of a package or module at the top level.
    """
    try:
        spec = importlib.util.find_spec(package)
    except (ImportError, ValueError):  # said where it is imported
        return frozenset()
    return frozenset() if spec is None else places_of(with_imports(spec_files(spec)))


def spec_files(spec: ModuleSpec) -> list[File]:
    """List the files of a package, or that of a module; none of what has no file."""
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    if folders or not spec.has_location:
        return package_files(folders)
    origin = Path(str(spec.origin))
    return [(origin.name, origin)]


def with_imports(files: Iterable[File]) -> list[File]:
    """Add the files of what sources import, and what that imports, where it is the user's own.

    Of an installed package it is the file with its name and version; of one that adeye itself needs
    and of the standard library, nothing. Of a package that is imported the code counts, but not its
    data. Of a source that imports by name it is all that can be imported in its folder and below.
    What a source says that it reads, in ``adeye_files``, counts with it.

    Raises:
        SpecError: It says so in another way than by a list of names, or such a file is not there.
    """
    own, installed = _imports(found := list(files))
    imported = [file for code in own.values() for file in code]
    beside = _by_name([*found, *imported])
    # Under one label, whether what is beside has been put on the path by now or not.
    known = {path.resolve() for _, path in beside}
    found += [file for file in imported if file[1].resolve() not in known]
    return [*found, *beside, *_read_by([*found, *beside]), *_releases(installed)]


def _read_by(files: Iterable[File]) -> list[File]:
    """List the files that sources say they read, with the source in their labels."""
    found = []
    for label, path in files:
        if path.suffix != ".py":
            continue
        try:
            state = path.stat()
        except OSError:  # whoever hashes it says so
            continue
        names, line = _told_files(path, state.st_mtime_ns, state.st_ctime_ns, state.st_size)
        for name in names:
            at, folder = (path.parent / name).resolve(), path.parent.resolve()
            if Path(name).is_absolute() or not at.is_relative_to(folder) or not at.is_file():
                raise SpecError(
                    f"{FILES}: there is no file {name!r} beside it or below",
                    where=SourceLocation(str(path), line, 1),
                    remedy="Name files relative to the source that reads them.",
                )
            found.append((f"{label}{NAMES}{name}", at))
    return found


@lru_cache(maxsize=4096)
def _told_files(path: Path, *_state: int) -> tuple[tuple[str, ...], int]:
    """Return the names of the files that a source says it reads, and in which line it does."""
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):  # refused where it is executed
        return (), 1
    for node in tree.body:
        is_named = isinstance(node, ast.Assign | ast.AnnAssign) and any(
            isinstance(target, ast.Name) and target.id == FILES
            for target in (node.targets if isinstance(node, ast.Assign) else [node.target])
        )
        if not is_named:
            continue
        told = getattr(node, "value", None)
        items = told.elts if isinstance(told, ast.Tuple | ast.List) else [told]
        names = [item.value for item in items if isinstance(item, ast.Constant)]
        texts = [name for name in names if isinstance(name, str) and name]
        if len(texts) < len(items) or not isinstance(told, ast.Tuple | ast.List):
            raise SpecError(
                f"{FILES} is no plain list of names",
                where=SourceLocation(str(path), node.lineno, 1),
                remedy=f'Write {FILES} = ["limits.csv"]; it is read, not executed.',
            )
        return tuple(dict.fromkeys(texts)), node.lineno
    return (), 1


def _by_name(files: Sequence[File]) -> list[File]:
    """List what may be imported of the folders of sources that import by name, these left out."""
    sources = [path for _, path in files if path.suffix == ".py" and not is_installed(path)]
    named = [path for path in sources if stated_imports(path) is None]
    return [
        (f"{_HERE}{label}", path)
        for label, path in package_files(dict.fromkeys(path.parent for path in named))
        if path.suffix in _IMPORTABLE and path.resolve() not in {item.resolve() for item in named}
    ]


def own_imports(files: Iterable[File]) -> dict[str, list[File]]:
    """List the user's own packages and modules that sources import, with their files."""
    return _imports(files)[0]


_MOST_SOURCE: Final = 1 << 20
"""Larger files that do not end in .py are data [bytes]."""


_IMPORTABLE: Final = (".py", ".pyc", ".so")
"""Endings of what a Python imports, whichever its version."""
_UNCHECKED: Final = b"\1\0\0\0"
"""Flags, behind its magic number, of byte code whose source nobody asks for (PEP 552)."""
_WORD: Final = 0xFFFFFFFF
_MODULE: Final = re.compile(r"(\w+)(\.pyc?|(\.[\w-]+)?\.so)?")
"""Name of a package or module with its ending, which may name the version."""


def imports_beside(program: Path, by: str = "") -> list[Path]:
    """List what is in the folder of a program that it imports, and what that imports.

    Where that cannot be read, as of compiled code, in the syntax of another version or where it is
    imported by name, it is all that can be imported.

    Args:
        program: Any file; what is no Python imports nothing.
        by: Name of what executes it.

    Raises:
        SpecError: The byte code beside one, which Python trusts by time and size, is of another
            source.
    """
    with program.open("rb") as stream:
        told = f"{by} {stream.readline(100)!r}"
    is_python = program.suffix == ".py" or re.search(r"\bpy(thon|py)", told) is not None
    # A program need not end in .py.
    is_source = is_python or program.stat().st_size <= _MOST_SOURCE
    found, left = {program}, [program] if is_source else []
    while left:
        names = stated_imports(path := left.pop())
        if names is None and path == program and not is_python:
            break
        new = _importable(program.parent, names) - found
        left += new
        found |= new
    for path in sorted(found):
        _require_own_byte_code(path)
    return sorted(found - {program})


def _importable(folder: Path, names: frozenset[str] | None) -> set[Path]:
    """List the files of modules in a folder: of these names, or of all."""
    places = [folder]
    if names is not None:
        known = ((_MODULE.fullmatch(path.name), path) for path in folder.iterdir())
        places = [path for name, path in known if name is not None and name[1] in names]
    files = (*places, *(path for _, path in package_files(places)))
    return {path for path in files if path.suffix in _IMPORTABLE and path.is_file()}


def _require_own_byte_code(path: Path) -> None:
    """Refuse a source for which a Python would take byte code beside it that is not of it.

    That of another version than this one's cannot be made here; it is older than what was put into
    the place of its source.
    """
    state, spec = path.stat(), importlib.util.spec_from_file_location(path.stem, path)
    by_time = struct.pack("<3I", 0, int(state.st_mtime) & _WORD, state.st_size & _WORD)
    for kept in path.parent.glob(f"__pycache__/{escape(path.stem)}.*.pyc"):
        head = kept.read_bytes()[4:16]
        if not head.startswith(_UNCHECKED) and head != by_time:
            continue
        is_theirs = kept.stat().st_mtime >= state.st_ctime
        if spec is not None and str(kept) == spec.cached:
            is_theirs = _is_byte_code_of(spec, path.read_bytes())
        if not is_theirs:
            raise _other_byte_code("", path.stem, path)


def _other_byte_code(before: str, name: str, path: Path) -> SpecError:
    return SpecError(
        f"{before}the byte code of {name} is of another source than {path}",
        remedy=f"Delete {path.parent / '__pycache__'}.",
    )


def _imports(files: Iterable[File]) -> tuple[dict[str, list[File]], set[str]]:
    """List what is the user's own, with its files, and what is installed."""
    left = list(files)
    inside = {path.resolve() for _, path in left}
    found: dict[str, list[File] | None] = {}
    while left:
        _, path = left.pop()
        if path.suffix != ".py":
            continue
        for name in sorted(_stated(path)[0] - found.keys()):
            own = _own(name)
            is_new = own is not None and inside.isdisjoint(file.resolve() for _, file in own)
            found[name] = own if is_new or own is None else []
            left += found[name] or []
    own_code = {name: own for name, own in sorted(found.items()) if own}
    return own_code, {name for name, own in found.items() if own is None}


def _releases(names: Iterable[str]) -> list[File]:
    """List the files that tell the versions of the distributions of installed modules."""
    known = _distributions()
    releases = {release for name in names for release in known.get(name, ())}
    found: dict[str, Path] = {}
    for release in sorted(releases):
        files = distribution(release).files if _plain(release) not in _needed() else None
        for file in files or ():
            if file.name == "METADATA":
                found[f"{release}/METADATA"] = Path(str(file.locate()))
    return list(found.items())


@cache
def _distributions() -> Mapping[str, list[str]]:
    return packages_distributions()


@cache
def _needed() -> frozenset[str]:
    """Return the distributions that adeye needs, whose versions stand beside its results."""
    needed = (text for text in requires("adeye") or () if "extra ==" not in text)
    return frozenset(_plain(re.split(r"[^\w.-]", text, maxsplit=1)[0]) for text in needed)


def _plain(name: str) -> str:
    """Write the name of a distribution in the one way in which it is compared (PEP 503)."""
    return re.sub(r"[-_.]+", "-", name).lower()


def stated_imports(path: Path) -> frozenset[str] | None:
    """Return the top levels of what a source imports; None if statements do not tell all."""
    names, is_all = _stated(path)
    return names if is_all else None


def _stated(path: Path) -> tuple[frozenset[str], bool]:
    """Return what statements of a source import, see ``_names_in``."""
    try:
        state = path.stat()
    except OSError:  # whoever hashes it says so
        return frozenset(), True
    return _names_in(path, state.st_mtime_ns, state.st_ctime_ns, state.st_size)


_BY_NAME: Final = {"__import__", "exec", "eval", "importlib", "imp", "runpy", "zipimport"} | {
    f"sys.{name}" for name in ("path", "meta_path", "path_hooks", "modules")
}
"""What a source uses that may import, or execute, what no statement of it names."""
_COMPUTED: Final = re.compile(rf"\b({'|'.join(sorted(_BY_NAME - {'sys.path'}))})\b")
"""The same without what still leaves names to statements."""
_BESIDE_ITSELF: Final = re.compile(
    r"__(file|spec|loader|path|cached)__|\b(inspect|pkgutil|resources|_getframe)\b"
)
"""What a module asks where it lies: equal ones in two places may read other files there."""


@lru_cache(maxsize=4096)
def _names_in(path: Path, *_state: int) -> tuple[frozenset[str], bool]:
    """Return the top levels of the modules that a source imports anywhere, by its statements.

    Also whether that is all: it can be read, and imports nothing that no statement names.
    """
    try:
        tree = ast.parse(path.read_bytes())
    except (SyntaxError, ValueError):  # of a plug-in refused where it is executed
        return frozenset(), False
    names: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names |= {item.name.partition(".")[0] for item in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level and node.module:
            names.add(node.module.partition(".")[0])
            names |= {f"sys.{item.name}" for item in node.names if node.module == "sys"}
        elif isinstance(node, ast.Name) and node.id in _BY_NAME:
            names.add(f".{node.id}")
        elif isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            names.add(f"{node.value.id}.{node.attr}")
    is_all = not any(name.removeprefix(".") in _BY_NAME for name in names)
    return frozenset(name for name in names if "." not in name and name != "adeye"), is_all


def _own(name: str) -> list[File] | None:
    """List the code of a package or module of the user; None of what is installed or not there."""
    try:
        spec = importlib.util.find_spec(name)
    except (ImportError, ValueError):
        return None
    if spec is None:
        return None
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    is_file = spec.has_location and spec.origin is not None
    places = folders or ([Path(str(spec.origin))] if is_file else [])
    if not places or any(map(is_installed, places)):
        return None
    archives = [packed_in(place) for place in places if not place.exists()]
    if archives or not folders:
        return [(path.name, path) for path in (archives or places)]
    endings = tuple(all_suffixes())
    return [
        (f"{name}/{label}", path)
        for label, path in package_files(folders)
        if label.endswith(endings)
    ]


@cache
def ignore_kept_code() -> None:
    """Let numba read no machine code from disk but adeye's and that of installed packages.

    It is told from that of other sources by the file of the function alone: not by what it calls or
    reads from elsewhere.
    """
    from numba.core.caching import Cache

    load, home = Cache.load_overload, Path(__file__).parent

    def load_known(cache: Any, *asked: Any) -> Any:
        path = Path(cache._py_func.__code__.co_filename)
        return load(cache, *asked) if path.is_relative_to(home) or is_installed(path) else None

    Cache.load_overload = load_known


def require_executed(
    name: str, packages: Iterable[str], before: Collection[str], files: Iterable[File]
) -> None:
    """Refuse packages whose modules in memory are not what their files are now.

    Args:
        name: The part, as the user wrote it.
        packages: Top levels of the names of modules that it was loaded from.
        before: Names of the modules that were in memory before it was loaded.
        files: All that it is hashed by; whoever is in memory of one of these is looked at, too.

    Raises:
        SpecError: A file was changed since its module was imported, or the byte code beside it,
            which Python trusts by time and size, is of another source.
    """
    for package in sorted({*packages, *_packages_of(files)}):
        now = wall_time()
        since = _LOOKED.get(package, _process_start())
        for key, module in _in_memory(package):
            _require_current(name, key, module, None if key not in before else since)
        _LOOKED[package] = now


def require_unwritten(name: str, files: Iterable[File], since: float) -> None:
    """Refuse files that were written while they were executed: what was executed is not there.

    Args:
        name: The part, as the user wrote it.
        files: Its code.
        since: When the first of them was read [s since 1970].

    Raises:
        SpecError: One was.
    """
    for _, path in files:
        state = path.stat()
        if state.st_mtime > wall_time():
            raise SpecError(
                f"{name}: {path} was written in the future, says its time",
                remedy=f"touch {path}, and look at the clock of who wrote it.",
            )
        if max(state.st_mtime, state.st_ctime) > since:
            raise SpecError(
                f"{name}: {path} was written while it was being executed",
                remedy="Run again once it is as it is to stay; code does not write itself.",
            )


_resolved = cache(os.path.realpath)


def require_unkept(name: str, files: Sequence[File], *, is_executed: bool = False) -> None:
    """Refuse data that changed since a plug-in first read it here: somebody may have kept it.

    The file is executed anew, and the modules that it imports, whosever they are, are not. They may
    have kept what they read for another plug-in, too.

    Args:
        name: The part, as the user wrote it.
        files: All that it is hashed by.
        is_executed: Whether the part was, meanwhile: then what it was may be held from now on, also
            once it is again what it was first.

    Raises:
        SpecError: Its data is not what it was.
    """
    # A process has thousands of modules, and plans often: links to them are followed once.
    imported = {
        _resolved(file)
        for module in list(sys.modules.values())
        if (file := getattr(module, "__file__", None)) is not None
    }
    for number, (label, path) in enumerate(files):
        place = os.path.realpath(path)
        # The part itself is executed anew, and what is in memory is compared with its file. All
        # else may be read as data, whatever it ends in.
        is_code = not number and label == path.name
        is_read = NAMES in label or not (is_code or place in imported)
        now = files_digest([("", path)]) if is_read else ""
        is_other = is_read and _NAMED.setdefault(place, now) != now
        if is_other and is_executed:
            _HELD.add(place)
        if is_other or place in _HELD:
            raise SpecError(
                f"{name}: this process may hold what {path} was before it was written",
                remedy=_ANEW,
            )


def may_hold(paths: Iterable[Path]) -> None:
    """Note that files were other ones while code was executed, which may have kept what they said.

    Whoever reads them is refused in this process, also once they are what they were.
    """
    _HELD.update(map(os.path.realpath, paths))


def require_told_apart(name: str, files: Sequence[File]) -> None:
    """Refuse modules that are imported by name where another one has the name in this process.

    Python imports a name once: whoever comes second gets the module of the first, though it is
    hashed by its own.

    Args:
        name: The part, as the user wrote it.
        files: All that it is hashed by.

    Raises:
        SpecError: Another part has another module of the name beside it, or one is in memory.
    """
    for module, own in _named_beside(files).items():
        places = {os.path.realpath(path) for _, path in own}
        found = min(places), files_digest((path.name, path) for _, path in own)
        there = _BESIDE.setdefault(module, found)
        is_other = there[1] != found[1] or any(
            _BESIDE_ITSELF.search(_text(path)) for _, path in own
        )
        other = Path(there[0]) if there[0] not in places and is_other else None
        loaded = _file_in_memory(module)
        if loaded is not None and os.path.realpath(loaded) not in places:
            is_same = len(own) == 1 and file_digest(loaded) == file_digest(own[0][1])
            other = other if is_same and not is_other else loaded
        _require_one(name, module, own[0][1], other)
    for module in sorted({name for _, path in files for name in _stated(path)[0]}):
        first, *others = _candidates(module) or [Path()]
        digests = {file_digest(path): path for path in (first, *others)} if others else {}
        _require_one(name, module, first, others[0] if len(digests) > 1 else None)


def helpers_of(files: Sequence[File]) -> frozenset[str]:
    """Give the places of the modules that a part may share with others in this process."""
    named = {path for own in _named_beside(files).values() for _, path in own}
    return places_of(
        (label, path)
        for label, path in files
        if path.suffix in _IMPORTABLE
        and NAMES not in label
        and (not label.startswith(_HERE) or path in named)
    )


def require_own_data(
    name: str, helpers: frozenset[str], data: frozenset[str], known: frozenset[str] | None
) -> None:
    """Refuse that a module hands a sealed part what it read for another one.

    Nobody sees what passes within a module, so what it reads has to be in both identities.

    Args:
        name: The part, as the user wrote it.
        helpers: Places of the modules that it was loaded from.
        data: Places of the files of data that identify it.
        known: Places of all that it is hashed by, if it is sealed.

    Raises:
        SpecError: One names data and another one does not, which shares a module with it.
    """
    for helper in sorted(helpers):
        read, sealed_parts = _HANDED.setdefault(helper, ({}, {}))
        read.update(dict.fromkeys(data, name))
        if known is not None:
            sealed_parts[name] = known
        for part, places in sealed_parts.items():
            for place in sorted(read.keys() - places):
                raise SpecError(
                    f"{part}: {helper} may hand it what {place} says, which {read[place]} reads "
                    f"and {part} does not name",
                    remedy=f"Name it in the source of {part}, in {FILES}, or give one of the two "
                    f"a copy of {Path(helper).name} under another name.",
                )


def data_of(files: Iterable[File]) -> frozenset[str]:
    """Give the places of the data among the files that identify a part."""
    return places_of(
        (label, path) for label, path in files if NAMES in label or path.suffix not in _IMPORTABLE
    )


def require_own_state(name: str, helpers: frozenset[str]) -> None:
    """Refuse a module that one part changes and another one uses, too.

    What a part puts into the variables of a module is in no identity of the other's results, and
    which of the two came last decides. So what each part left when it was first loaded is compared
    with what the source alone makes, once the module has a second user.

    Args:
        name: The part, as the user wrote it.
        helpers: Places of the modules that it was loaded from.

    Raises:
        SpecError: A variable is another one.
    """
    keys = set(map(_content_of, map(Path, helpers)))
    new = {key for key in keys if name not in _SHARED.get(key, ())}
    found = dict(_modules_in_memory(new)) if new else {}
    for key in new:
        module = found.get(key)
        left = {} if module is None else variables_of(vars(module))
        _SHARED.setdefault(key, {})[name] = left
    try:
        for key, module in found.items():
            users = list(_SHARED[key].items())  # another thread may add one meanwhile
            for part, left in users if len(users) > 1 else ():
                _require_same(part, key, module, left, is_whole=True)
        _require_as_written(keys - new)
        _USED.get(set()).update(keys)
    except SpecError:
        for key in new:  # it is no user: whoever tries again hears the same
            _SHARED[key].pop(name, None)
        raise


@contextmanager
def settings_kept() -> Iterator[None]:
    """Refuse, at its end, a module whose settings changed while the parts loaded in it computed.

    Raises:
        SpecError: A variable is not what the source says.
    """
    used: set[tuple[str, str]] = set()
    before = _USED.set(used)
    try:
        yield
    finally:
        _USED.reset(before)
    _require_as_written(used)


def _require_as_written(keys: Iterable[tuple[str, str]]) -> None:
    """Refuse a module that several parts use and whose settings one of them has changed.

    Settings are numbers, texts and arrays, also within tables, records and classes. What is added
    to a table may be kept there, as whatever else was computed.

    Args:
        keys: Names and hashes of the modules that are looked at.

    Raises:
        SpecError: A variable is not what the source says.
    """
    shared = {key for key in keys if len(_SHARED[key]) > 1}
    for key, module in _modules_in_memory(shared):
        _require_same(min(_SHARED[key]), key, module, variables_of(vars(module)), is_whole=False)


def _require_same(
    part: str, key: tuple[str, str], module: ModuleType, left: Mapping[str, Held], *, is_whole: bool
) -> None:
    """Compare what a part left in a module with what the source alone makes."""
    wanted = _as_written(key, module)
    for variable, held in left.items():
        known = wanted.get(variable)
        if known is None:
            # What is new within another one may be kept; a name of its own is a setting.
            is_same = not (is_whole or (held.is_plain and variable.isidentifier()))
        else:
            is_same = known in {held, _ANYTHING}
            is_same |= not (is_whole or (held.is_plain and known.is_plain))
        if not is_same:
            others = ", ".join(sorted(set(_SHARED[key]) - {part}))
            raise SpecError(
                f"{part}: {module.__file__} is used by {others}, too, and {variable} in it is not "
                "what its source says: one of them has set it",
                remedy=f"Hand settings over as parameters, or give each a copy of {key[0]} under "
                "another name.",
            )


def _modules_in_memory(
    keys: Collection[tuple[str, str]],
) -> Iterator[tuple[tuple[str, str], ModuleType]]:
    """Give the modules that were imported from files of these names and hashes."""
    names = {name for name, _ in keys}
    for module in list(sys.modules.values()) if names else ():
        file = str(getattr(module, "__file__", None) or "")
        if file.rpartition(os.sep)[2] not in names or not isinstance(module, ModuleType):
            continue
        # What has no such origin was not imported: it is a part itself.
        is_imported = getattr(module.__spec__, "origin", None) == file
        path = Path(file)
        if is_imported and not is_installed(path) and (key := _content_of(path)) in keys:
            yield key, module


def _content_of(path: Path) -> tuple[str, str]:
    state = path.stat() if path.is_file() else None
    return path.name, "" if state is None else _hash_of(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=1024)
def _hash_of(path: Path, *_state: int) -> str:
    return file_digest(path)


def _as_written(key: tuple[str, str], module: ModuleType) -> dict[str, Held]:
    """Return the variables that a module's source makes, executed by itself, twice.

    What is not the same twice, such as a time, may be anything.
    """
    if key not in _AS_WRITTEN:
        assert module.__spec__ is not None
        one, other = (variables_of(_executed_anew(module.__spec__)) for _ in "12")
        _AS_WRITTEN[key] = {
            name: held if other.get(name) == held else _ANYTHING for name, held in one.items()
        }
    return _AS_WRITTEN[key]


def _executed_anew(spec: ModuleSpec) -> dict[str, Any]:
    anew = importlib.util.spec_from_file_location(
        spec.name, spec.origin, submodule_search_locations=spec.submodule_search_locations
    )
    assert anew is not None
    assert anew.loader is not None
    copy = importlib.util.module_from_spec(anew)
    with guest(spec.name, "module", is_loaded=False):
        anew.loader.exec_module(copy)
    return vars(copy)


def _require_one(name: str, module: str, place: Path, other: Path | None) -> None:
    if other is not None:
        raise SpecError(
            f"{name}: {module} is {place} here, and {other} is or may be imported for it",
            remedy="Give one of the two another name. A new process is enough if the other one was "
            "loaded for another ODD.",
        )


def _candidates(module: str) -> list[Path]:
    """List the user's files that a module may be, in memory and in the folders of the path."""
    found = [] if (loaded := _file_in_memory(module)) is None else [loaded]
    for folder in map(Path, sys.path):
        files = (folder / f"{module}.py", folder / module / "__init__.py")
        found += [file for file in files if file.is_file() and not is_installed(file)]
    return list({os.path.realpath(file): file for file in found}.values())


def _named_beside(files: Sequence[File]) -> dict[str, list[File]]:
    """Give what a part imports by name, by its module: what its sources state.

    Of a source that executes text, or imports what it computes, it is all that is there.
    """
    beside: dict[str, list[File]] = {}
    left = []
    for label, path in files:
        if label.startswith(_HERE):
            for module in _modules_of(label, path):
                beside.setdefault(module, []).append((label, path))
        elif path.suffix == ".py":
            left.append(path)
    found: dict[str, list[File]] = {}
    while left:
        source = left.pop()
        names, is_open = _stated(source)[0], _COMPUTED.search(_text(source))
        for module in beside.keys() - found.keys():
            if is_open or module in names:
                found[module] = beside[module]
                left += [path for _, path in beside[module] if path.suffix == ".py"]
    return dict(sorted(found.items()))


def _text(path: Path) -> str:
    return path.read_text("utf-8", "replace")


def _modules_of(label: str, path: Path) -> set[str]:
    """Return the top levels that a file beside a source may be of, whichever folder is searched."""
    *folders, file = label.removeprefix(_HERE).split("/")
    names, folder = [file.partition(".")[0]], path.parent
    while folders and (folder / "__init__.py").is_file():  # a package, imported by its own name
        names, folder = [folders.pop()], folder.parent
    return {*names, *folders[:1]}


def _file_in_memory(module: str) -> Path | None:
    """Return the file of a module of the user's that is in memory."""
    file = getattr(sys.modules.get(module), "__file__", None)
    path = None if file is None else Path(file)
    return path if path is not None and path.is_file() and not is_installed(path) else None


def _packages_of(files: Iterable[File]) -> Iterator[str]:
    """Give the top levels of the modules that were imported from some files."""
    places = {str(place) for _, path in files for place in (path, path.resolve())}
    for key, module in list(sys.modules.items()):
        if getattr(module, "__spec__", None) and getattr(module, "__file__", None) in places:
            yield key.partition(".")[0]


def _in_memory(package: str) -> Iterator[tuple[str, ModuleType]]:
    """Give the modules of a package that were executed from a source file, with their names."""
    for key, module in list(sys.modules.items()):
        is_source = str(getattr(module, "__file__", "")).endswith(".py")
        if key.partition(".")[0] == package and is_source:
            yield key, module


def _require_current(name: str, key: str, module: ModuleType, since: float | None) -> None:
    path = packed_in(Path(str(module.__file__)))
    content = path.read_bytes()
    # What it names it may have read when it was imported.
    read = _read_by([(path.name, path)]) if path.suffix == ".py" else ()
    files = [path, *(file for _, file in read)]
    digest = files_digest((file.name, file) for file in files)
    known = _EXECUTED.get(key)
    written = max(max(file.stat().st_mtime, file.stat().st_ctime) for file in files)
    is_late = since is not None and written > since
    if known is None and not is_late and _is_byte_code_of(module.__spec__, content):
        _EXECUTED[key] = known = digest
    if known == digest:
        return
    if known is not None or is_late:
        told = map(str, files)
        raise SpecError(
            f"{name}: {key} is in memory as it was before {' or '.join(told)} was written",
            remedy=_ANEW,
        )
    raise _other_byte_code(f"{name}: ", key, path)


def _is_byte_code_of(spec: ModuleSpec | None, content: bytes) -> bool:
    """Tell whether what Python keeps compiled of a module is what its source compiles to."""
    loader = spec.loader if spec is not None else None
    if spec is None or not isinstance(loader, SourceFileLoader):
        return True
    if spec.cached is None or not Path(spec.cached).is_file():
        return True
    try:
        compiled: Any = loader.source_to_code(content, loader.path)
        return bool(compiled == loader.get_code(spec.name))
    except (SyntaxError, ValueError, EOFError):
        return False


def wall_time() -> float:
    """Return the time [s since 1970]."""
    return time.time()  # noqa: TID251 - to be compared with times of files


@cache
def _process_start() -> float:
    """Return when this process began [s since 1970]; where nobody tells, when it asked first."""
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        started = int(fields[_STARTED]) / os.sysconf("SC_CLK_TCK")
        return wall_time() - (time.clock_gettime(time.CLOCK_BOOTTIME) - started)
    except (OSError, ValueError, AttributeError, IndexError):
        return wall_time()
