"""Files that verbs write: how they may be called, and that none of them is what a verb reads."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, get_type_hints

from adeye.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

PAGES: Final = (".html", ".htm")


def given(path: Path | None) -> Path | None:
    """Refuse a name that is rather an option whose file was forgotten; a callback of options.

    Raises:
        UsageError: The name begins with a dash.
    """
    if path is not None and str(path).startswith("-"):
        raise UsageError(
            f"{str(path)!r} stands where the name of a file is expected",
            remedy=f"Name the file first; for a file of this name write ./{path}.",
        )
    return path


def named(path: Path | None) -> Path | None:
    """Do as ``given``, and refuse a folder; the callback of options that name a file to write.

    Raises:
        UsageError: The name begins with a dash, or is that of a folder.
    """
    if named_place(path) is not None and path is not None and path.is_dir():
        raise UsageError(f"{str(path)!r} is a folder", remedy="Name a file to write.")
    return path


def named_place(path: Path | None) -> Path | None:
    """Do as ``given``; the callback of options that name a file or a folder to write."""
    return given(path)


def named_page(path: Path | None) -> Path | None:
    """Refuse a name that promises another form than HTML; a callback of options.

    Raises:
        UsageError: The name begins with a dash, or ends neither in .html nor in .htm.
    """
    if named(path) is not None and path is not None and path.suffix.lower() not in PAGES:
        raise UsageError(
            f"{str(path)!r} does not end in {' or '.join(PAGES)}, and a page of HTML is written",
            remedy="Give it that ending; a browser prints the page as PDF.",
        )
    return path


def named_anew(path: Path | None) -> Path | None:
    """Do as ``named``; the callback of the option whose verb writes a kind of evidence anew."""
    return named(path)


_WRITTEN: Final = (named, named_anew, named_page, named_place)


@contextmanager
def guarding(verb: Callable[..., None], options: Mapping[str, Any]) -> Iterator[None]:
    """Let a verb run while none of the files that it writes is its database, or what it reads.

    Args:
        verb: A function whose options for what it writes have one of ``_WRITTEN``.
        options: What it is called with.

    Raises:
        UsageError: A file to write is one of the others; see ``outputs.guarded``.
    """
    callbacks = {
        name: getattr(item, "callback", None)
        for name, hint in get_type_hints(verb, include_extras=True).items()
        for item in getattr(hint, "__metadata__", ())
        if options.get(name) is not None
    }
    outputs = {name: options[name] for name, found in callbacks.items() if found in _WRITTEN}
    if not outputs:
        yield
        return
    from adeye.outputs import reads
    from adeye.report.files import guarding as guarding_files

    files = {_option(name): path for name, path in outputs.items()}
    anew = next((_option(name) for name in outputs if callbacks[name] is named_anew), "")
    with guarding_files(options.get("db"), files, renewed=anew):
        for name in options.keys() - outputs.keys() - {"db"}:
            value = options[name]
            for item in value if isinstance(value, list) else [value]:
                # Whatever text an option has, it may name a file.
                if isinstance(item, str | Path):
                    reads(item)
        yield


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def write_rows(header: Sequence[str], rows: Iterable[Sequence[Any]], path: Path) -> None:
    """Write a CSV file as a whole or not at all; missing folders are made.

    Raises:
        PlatformError: The file system refused; what was there before still is.
    """
    from adeye.cli.output import csv_text
    from adeye.outputs import write_atomically

    write_atomically(csv_text(header, rows).encode(), path)
