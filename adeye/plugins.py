"""Parts from outside the package and files that they read: found by name, hashed, checked."""

from __future__ import annotations

import hashlib
import inspect
import sys
import traceback
from collections.abc import Callable
from contextlib import AbstractContextManager, contextmanager
from copy import deepcopy
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final

from pydantic import BaseModel, ValidationError

from adeye.errors import PlatformError, PluginError, SourceLocation, SpecError, suggest
from adeye.identity import file_digest
from adeye.outputs import reads
from adeye.plugin_code import (
    File,
    code_digest,
    data_of,
    files_digest,
    helpers_of,
    ignore_kept_code,
    own_imports,
    package_files,
    places_of,
    places_of_package,
    require_executed,
    require_own_data,
    require_own_state,
    require_told_apart,
    require_unkept,
    require_unwritten,
    stated_imports,
    wall_time,
    with_imports,
)
from adeye.supervision import (
    guest,
    identified,
    is_asked,
    place_of_user,
    require_identified,
    said,
    sealed,
    take_refusal,
)
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from pydantic_core import ErrorDetails

Loc = tuple[str | int, ...]
Nameable = Callable[[Any], bool]
Entering = Callable[[str, frozenset[str]], AbstractContextManager[None]]
"""How code of a part is let in, by its name and the places of what it is hashed by."""

_FORM: Final = "Write module:Class, or ./file.py:Class relative to the file that names it."
_LABEL: Final = "adeye_plugin_"
_CACHE: dict[tuple[str, str, str], Part] = {}

LARGEST_FILE: Final = 2**30
"""Largest file that is hashed [bytes]. Our choice: weights of the networks that drive are smaller,
and reading more at each plan would keep people waiting."""


@dataclass(frozen=True, slots=True)
class Part:
    """A class from outside the package, and what identifies its code.

    Attributes:
        obj: The class.
        name: As the user wrote it.
        source_digest: sha256 of its source: of the file, or of all files of its package.
        version: ``__version__`` of its module or package, empty if there is none.
        places: Of the files that it is hashed by, without links: what it may read where it is
            sealed.
        helpers: Places of the modules that it may share with other parts.
    """

    obj: Any
    name: str
    source_digest: str
    version: str
    places: frozenset[str] = frozenset()
    helpers: frozenset[str] = frozenset()

    def build(self, *arguments: Any) -> Any:
        """Make an instance of the class."""
        with guest(self.name):
            return self.obj(*arguments)


@dataclass(frozen=True, slots=True)
class ReadFile:
    """A file that a part says it reads, and what identifies its content.

    Attributes:
        owner: The part that reads it, such as ``channels.nominal``.
        name: As the user wrote it.
        path: Where it was found.
        digest: sha256 of its content.
    """

    owner: str
    name: str
    path: Path
    digest: str


@dataclass(frozen=True, slots=True)
class Validated:
    """Outcome of checking a plug-in's parameters.

    Attributes:
        parameters: The validated model; None if there are errors, or the class declares none.
        errors: Place in the parameters and message of each error.
    """

    parameters: BaseModel | None
    errors: tuple[tuple[Loc, str], ...]


def load_part(
    name: str,
    base_dir: Path,
    *,
    is_nameable: Nameable = inspect.isclass,
    is_sealed: bool = False,
) -> Part:
    """Load the class that a user named; nothing else is searched or imported.

    Args:
        name: ``module:Class`` or ``./file.py:Class``.
        base_dir: Folder of the file that names it.
        is_nameable: Tells what of the module the message offers if the name is not there.
        is_sealed: It may read no file that is not in its identity, see ``plugin_code.sealed``.

    Raises:
        SpecError: There is no such file, module or class, or its code cannot be executed.
        PlatformError: Python leaves its asserts out, with which it may say that it failed.
    """
    if sys.flags.optimize:
        raise PlatformError(
            f"{name} would be executed without its asserts, and no result would tell. "
            "Unset PYTHONOPTIMIZE, or use no -O."
        )
    ignore_kept_code()
    source, _, attribute = name.rpartition(":")
    if not source or not attribute.isidentifier():
        raise SpecError(f"{name!r} does not name a class", remedy=_FORM)
    entering = _sealed_guest if is_sealed else _guest
    if source.endswith(".py"):
        path = (base_dir / source).resolve()
        part, code = _from_file(name, path, attribute, is_nameable, entering)
    else:
        part, code = _from_module(name, source, attribute, is_nameable, entering)
    part = replace(part, name=name, places=places_of(code), helpers=helpers_of(code))
    require_own_data(name, part.helpers, data_of(code), part.places if is_sealed else None)
    require_own_state(name, part.helpers)
    return part


@contextmanager
def _sealed_guest(name: str, known: frozenset[str]) -> Iterator[None]:
    with guest(name, is_loaded=False), sealed(name, known):
        yield


def _guest(name: str, _: frozenset[str]) -> AbstractContextManager[None]:
    return guest(name, is_loaded=False)


def locate_file(name: str, base_dir: Path) -> Path:
    """Return where a file is that somebody names.

    Args:
        name: Path relative to ``base_dir``, in it or below.
        base_dir: Folder of the file that names it.

    Raises:
        SpecError: There is no such file, or it lies elsewhere.
    """
    folder = base_dir.resolve()
    try:
        path = (folder / name).resolve()
        if Path(name).is_absolute() or not path.is_relative_to(folder):
            raise SpecError(
                f"{shown(name)} is outside of {shown(str(folder))}",
                remedy="Put it into the folder of the file that names it, or below.",
            )
        if not path.is_file():
            is_there = path.exists()
            raise SpecError(
                f"{shown(name)} is {'no file' if is_there else 'not there'}",
                remedy=f"Looked for {shown(str(path))}; "
                f"{'list each file by itself' if is_there else 'check the path'}.",
            )
    except (OSError, ValueError, RuntimeError) as error:  # too long, null bytes, a loop of links
        raise _unreadable(name, error) from error
    return path


def _unreadable(name: str, error: Exception) -> SpecError:
    return SpecError(
        f"{shown(name)} cannot be read: {error}", remedy="Check the path and who may read it."
    )


def read_file(owner: str, name: str, base_dir: Path) -> ReadFile:
    """Hash a file that a part reads.

    Args:
        owner: The part.
        name: Path relative to ``base_dir``, in it or below.
        base_dir: Folder of the file that names it.

    Raises:
        SpecError: There is no such file, it lies elsewhere, is too large or cannot be read.
    """
    path = locate_file(name, base_dir)
    reads(path)
    try:
        size = path.stat().st_size
        if size > LARGEST_FILE:
            raise SpecError(
                f"{shown(name)} has {size / 2**30:.1f} GiB, more than {LARGEST_FILE / 2**30:g} GiB",
                remedy="List smaller files: all of it is hashed whenever a campaign is planned.",
            )
        found = file_digest(path)
    except OSError as error:
        raise _unreadable(name, error) from error
    return ReadFile(owner, name, path, found)


def require(part: Part, kind: str, methods: Sequence[str]) -> None:
    """Refuse a part that is no class or lacks a method.

    Args:
        part: What was loaded.
        kind: What it is used as, for the message.
        methods: Names that it must have.

    Raises:
        SpecError: Names the missing methods.
    """
    if not inspect.isclass(part.obj):
        raise SpecError(
            f"{part.name} is {type(part.obj).__name__}, not a class", remedy=f"Name a {kind} class."
        )
    with guest(part.name, kind):
        missing = [name for name in methods if not callable(getattr(part.obj, name, None))]
    if missing:
        needed = ", ".join(f"{method}()" for method in missing)
        raise SpecError(
            f"{part.name} has no {needed}, so it is no {kind}",
            remedy=f"A {kind} has {', '.join(f'{method}()' for method in methods)}.",
        )


def names_in(part: Part, kind: str, attribute: str) -> tuple[str, ...]:
    """Read the names that a class lists in an attribute; none if it has no such attribute.

    Args:
        part: What was loaded.
        kind: What it is used as, for the message.
        attribute: A tuple or list of names.

    Raises:
        SpecError: It is something else.
        PluginError: It raises.
    """
    with guest(part.name, kind):
        told = getattr(part.obj, attribute, ())
        names = tuple(told) if isinstance(told, tuple | list) else (told,)
    if any(type(name) is not str for name in names):
        raise SpecError(
            f"{part.name}.{attribute} is no tuple of names", remedy=f"Write {attribute} = ()."
        )
    return names


def validate_parameters(part: Part, values: Mapping[str, Any]) -> Validated:
    """Check YAML parameters against the class attribute ``Parameters`` of a part.

    Args:
        part: What was loaded.
        values: The mapping that the user wrote.

    Raises:
        SpecError: ``Parameters`` is no pydantic model.
    """
    with guest(part.name, "parameter model of"):
        model = getattr(part.obj, "Parameters", None)
    if model is None:
        errors = tuple(((key,), f"{part.name} declares no Parameters") for key in values)
        return Validated(None, errors)
    if not (inspect.isclass(model) and issubclass(model, BaseModel)):
        raise SpecError(
            f"{part.name}.Parameters is no parameter model",
            remedy="Derive it from adeye.ports.Parameters.",
        )
    with guest(part.name, "parameter model of"):
        try:
            # A validator of theirs may take apart what it is given.
            return Validated(model.model_validate(deepcopy(dict(values))), ())
        except ValidationError as error:
            found = error.errors(include_url=False, include_context=False, include_input=False)
    return Validated(None, tuple((item["loc"], _said(item, model)) for item in found))


def _said(item: ErrorDetails, model: type[BaseModel]) -> str:
    if item["type"] == "extra_forbidden" and len(item["loc"]) == 1:
        name = str(item["loc"][0])
        return f"there is no parameter {name!r}. {suggest(name, model.model_fields)}"
    return item["msg"].replace("Input should be", "must be")


def source_files(name: str, base_dir: Path) -> list[tuple[str, Path]]:
    """List the files whose content identifies a plug-in that has been loaded, with their labels.

    Args:
        name: As ``load_part`` took it.
        base_dir: Folder of the file that names it.
    """
    source = name.rpartition(":")[0]
    if source.endswith(".py"):
        path = (base_dir / source).resolve()
        return with_imports([(path.name, path)])
    return with_imports(_module_files(name, sys.modules[source]))


def source_digest(name: str, base_dir: Path) -> str:
    """Hash the source of a plug-in as it is on disk now, see ``source_files``.

    Raises:
        OSError: A file is not there any more.
    """
    is_file = name.rpartition(":")[0].endswith(".py")
    return code_digest(source_files(name, base_dir), is_file=is_file)


def plugins_digest(parts: Iterable[Part], files: Iterable[ReadFile] = ()) -> str:
    """Hash names, sources and versions of plug-ins and the files they read, whatever their order.

    >>> plugins_digest([]) == plugins_digest(())
    True
    """
    digest = hashlib.sha256()
    lines = {f"{part.name}\0{part.source_digest}\0{part.version}\n" for part in parts}
    # Told from parts by a name that none has: those have a class behind a colon.
    lines |= {f"file\0{file.owner}\0{file.name}\0{file.digest}\n" for file in files}
    for line in sorted(lines):
        digest.update(line.encode())
    return digest.hexdigest()


def _from_file(
    name: str, path: Path, attribute: str, is_nameable: Nameable, entering: Entering
) -> tuple[Part, list[File]]:
    if not path.is_file():
        raise SpecError(f"{name}: there is no file {path}", remedy=_FORM)
    since, content, before = wall_time(), path.read_bytes(), frozenset(sys.modules)
    files = [(path.name, path)]
    digest = code_digest(code := with_imports(files), is_file=True)
    # Before it is executed, too: what it reads then, it may keep.
    require_unkept(name, code)
    require_told_apart(name, code)
    known = _CACHE.get((str(path), attribute, digest))
    if known is None:
        with _apart(path, places_of(code)) as imported:
            module = _execute(name, path, content, digest, entering(name, places_of(code)))
            # By now it may have said where more of its code is found.
            digest = code_digest(code := with_imports(files), is_file=True)
            _require_own(name, imported(), places_of(code))
        try:
            require_unwritten(name, code, since)
        except SpecError:
            del sys.modules[module.__name__]
            raise
        known = _remember((str(path), attribute, digest), name, module, is_nameable)
    require_executed(name, own_imports(files), before, code)
    require_unkept(name, code, is_executed=True)
    require_told_apart(name, code)
    _require_identified(name, before, code)
    return known, code


@contextmanager
def _apart(path: Path, places: Collection[str]) -> Iterator[Callable[[], list[str]]]:
    """Execute a source that imports by name as if no other part had imported anything.

    What another one has imported would be there already, and nobody would see that it is used.

    Yields:
        Lists what has been imported since; nothing of a source whose statements tell all.
    """
    if stated_imports(path) is not None:
        yield list
        return
    others = {
        key: module
        for key, module in list(sys.modules.items())
        if key != "__main__"
        and not key.startswith(_LABEL)
        and place_of_user(module) not in {"", *places}
    }
    for key in others:
        del sys.modules[key]
    before = frozenset(sys.modules)
    try:
        yield lambda: _new_since(before)
    finally:
        sys.modules.update(others)


def _new_since(before: Collection[str]) -> list[str]:
    return [key for key in list(sys.modules) if key not in before and not key.startswith(_LABEL)]


_CODES: Final[dict[str, set[str]]] = {}
"""Digests of the code that was loaded in this process, by the name of the part."""
_BLAMED: Final[dict[tuple[str, str], str]] = {}
"""What a part was refused for, by its name and each code that it had until then."""


def _require_identified(name: str, before: Collection[str], code: Sequence[File]) -> None:
    """Refuse what a part imported that is not in its identity, now or when it was executed."""
    digest, known = files_digest(code), _CODES.setdefault(name, set())
    if (told := take_refusal(name)) is not None:
        _BLAMED.update(((name, code), told) for code in known)
    known.add(digest)
    if (name, digest) in _BLAMED:
        raise SpecError(_BLAMED[name, digest], remedy="Results hang on its code.")
    identified(places_of(code))
    _require_own(name, _new_since(before))


def _require_own(name: str, new: Iterable[str], *places: Collection[str]) -> None:
    try:
        require_identified(name, new, *places)
    except PluginError as error:
        raise SpecError(str(error), remedy="Results hang on its code.") from error


def _execute(
    name: str, path: Path, content: bytes, digest: str, entered: AbstractContextManager[None]
) -> ModuleType:
    try:
        code = compile(content, str(path), "exec")
    except SyntaxError as error:
        raise _syntax_error(name, str(path), error) from error
    except ValueError as error:  # null bytes
        where = SourceLocation(str(path), 1, 1)
        raise SpecError(str(error), where=where, remedy=f"Correct the plug-in {name}.") from error
    # The digest keeps two files of one stem, and two states of one file, apart.
    label = f"{_LABEL}{path.stem}_{digest[:12]}"
    if label in sys.modules:
        return sys.modules[label]
    module = ModuleType(label)
    module.__file__ = str(path)
    sys.modules[label] = module
    try:
        with entered:
            exec(code, module.__dict__)  # noqa: S102 - the user named this file to be executed
    except BaseException as error:
        sys.modules.pop(label, None)
        if is_asked(error):
            raise
        raise _import_error(name, str(path), error) from error
    return module


def _from_module(
    name: str, source: str, attribute: str, is_nameable: Nameable, entering: Entering
) -> tuple[Part, list[File]]:
    since, before = wall_time(), frozenset(sys.modules)
    before_it = places_of_package(source.partition(".")[0])
    try:
        with entering(name, before_it):
            module = import_module(source)
    except SyntaxError as error:
        raise _syntax_error(name, error.filename or source, error) from error
    except ModuleNotFoundError as error:
        if (error.name or "").startswith("adeye."):
            raise _import_error(name, source, error) from error
        raise SpecError(
            f"{name}: there is no module {error.name!r}",
            remedy="Install its package, or name a file as ./file.py:Class.",
        ) from error
    except BaseException as error:
        if is_asked(error):
            raise
        raise _import_error(name, source, error) from error
    files = _module_files(name, module)
    digest = files_digest(code := with_imports(files))
    require_executed(name, (source.partition(".")[0], *own_imports(files)), before, code)
    if source not in before:
        require_unwritten(name, code, since)
    require_unkept(name, code, is_executed=True)
    require_told_apart(name, code)
    known = _CACHE.get((source, attribute, digest))
    known = known or _remember((source, attribute, digest), name, module, is_nameable)
    _require_identified(name, before, code)
    return known, code


def _module_files(name: str, module: ModuleType) -> list[tuple[str, Path]]:
    """List the module's file, or every file of the package that it belongs to."""
    top = sys.modules[module.__name__.partition(".")[0]]
    folders = [Path(folder) for folder in getattr(top, "__path__", [])]
    if folders:
        return package_files(folders)
    origin = getattr(module, "__file__", None)
    if origin is None or not Path(origin).is_file():
        raise SpecError(
            f"{name}: the module {module.__name__!r} has no source file",
            remedy="A result names the code behind it; give a module that has a file.",
        )
    return [(Path(origin).name, Path(origin))]


def _remember(
    key: tuple[str, str, str], name: str, module: ModuleType, is_nameable: Nameable
) -> Part:
    _, attribute, digest = key
    with guest(name, "module of"):
        if not hasattr(module, attribute):
            known = sorted(
                label
                for label, value in vars(module).items()
                if is_nameable(value) and _is_own(label, value, module)
            )
            raise SpecError(f"{key[0]} has no {attribute!r}", remedy=suggest(attribute, known))
        top = sys.modules.get(module.__name__.partition(".")[0], module)
        version = getattr(module, "__version__", getattr(top, "__version__", ""))
        part = Part(getattr(module, attribute), name, digest, str(version))
    _CACHE[key] = part
    return part


def _is_own(label: str, value: Any, module: ModuleType) -> bool:
    """Tell whether a module defines something for others, and did not import it."""
    return not label.startswith("_") and getattr(value, "__module__", None) == module.__name__


def _syntax_error(name: str, path: str, error: SyntaxError) -> SpecError:
    where = SourceLocation(path, error.lineno or 1, error.offset or 1)
    return SpecError(error.msg, where=where, remedy=f"Correct the plug-in {name}.")


def _import_error(name: str, path: str, error: BaseException) -> SpecError:
    """Say where the code of a plug-in raised: in the deepest frame outside the import machinery."""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if not frame.filename.startswith("<frozen") and frame.filename != __file__
    ]
    line = (frames[-1].lineno or 1) if frames else 1
    where = SourceLocation(frames[-1].filename if frames else path, line, 1)
    remedy = f"Correct the plug-in {name}."
    if isinstance(error, ImportError) and (error.name or "").startswith("adeye."):
        remedy = f"Let {name} import what it needs from adeye.ports, and its tests adeye.testing."
    return SpecError(f"{type(error).__name__}: {said(error)}", where=where, remedy=remedy)
