"""The errors of adeye, one tree; each knows the exit code of the process that it ends.

AdeyeError
├── InputError      exit 2: the user wrote something that cannot be used
│   ├── SpecError, SweepError, ExpressionError, UnitError, UsageError
│   ├── MissingExtra: what was asked for needs a library that is not installed
│   └── InputErrors: several at once
├── PlatformError   exit 5: database, disk, permissions
│   └── LostConnection: to a server, which may answer again
├── IntegrityError  exit 4: stored evidence does not agree with itself
└── PluginError     exit 3: code from outside raised where no run can record it
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Final


@dataclass(frozen=True, slots=True)
class SourceLocation:
    """A place in a file, counted from 1; line 0 is the file as a whole."""

    path: str
    line: int
    column: int

    def __str__(self) -> str:
        """Write it as ``path:line:column``, the file as a whole as its path."""
        return f"{self.path}:{self.line}:{self.column}" if self.line else self.path


class AdeyeError(Exception):
    """Base of every error that adeye raises on purpose."""

    exit_code: int = 2


class InputError(AdeyeError):
    """The user wrote something that cannot be used.

    Attributes:
        message: What was wrong, the value, what is allowed.
        where: File, line and column, if it came from a file.
        remedy: What to do about it.
    """

    exit_code = 2

    def __init__(
        self, message: str, *, where: SourceLocation | None = None, remedy: str = ""
    ) -> None:
        super().__init__(message, where, remedy)
        self.message = message
        self.where = where
        self.remedy = remedy

    def __str__(self) -> str:
        """Write it as ``Class: file:line:column: message. remedy``."""
        place = f"{self.where}: " if self.where is not None else ""
        end = "" if self.message.endswith((".", "?", "!")) else "."
        return f"{type(self).__name__}: {place}{self.message}{end} {self.remedy}".rstrip()

    def __reduce__(self) -> tuple[object, ...]:
        """Keep the keyword arguments when the error crosses a process boundary."""
        return partial(type(self), where=self.where, remedy=self.remedy), (self.message,)


class SpecError(InputError):
    """A file does not say what its kind must say."""


class SweepError(InputError):
    """A sweep cannot be expanded as written."""


class ExpressionError(InputError):
    """A formula cannot be read or evaluated."""


class UnitError(InputError):
    """A quantity has no unit, or the wrong one."""


class UsageError(InputError):
    """A command or function was called in a way that it does not support."""


class MissingExtra(InputError):  # noqa: N818 - what is so, not who erred
    """What was asked for needs an extra of the package that is not installed."""

    @classmethod
    def of(cls, what: str, extra: str, *, otherwise: str = "") -> MissingExtra:
        """Say what needs which extra.

        Args:
            what: Begins the sentence, in the singular.
            extra: Name of the extra.
            otherwise: What can be done without it, after "or".

        >>> print(MissingExtra.of("a signature", "sign"))
        MissingExtra: a signature needs adeye[sign]. Install it: pip install 'adeye[sign]'.
        """
        instead = otherwise and f", or {otherwise}"
        return cls(
            f"{what} needs adeye[{extra}]",
            remedy=f"Install it: pip install 'adeye[{extra}]'{instead}.",
        )


class InputErrors(InputError):  # noqa: N818 - several errors
    """Several input errors, each on a line of its own.

    Attributes:
        errors: Those that are listed.
        unlisted: How many more there are.
    """

    def __init__(self, errors: Sequence[InputError], *, unlisted: int = 0) -> None:
        count = len(errors) + unlisted
        super().__init__(amount(count, "error"))
        self.errors = tuple(errors)
        self.unlisted = unlisted

    def __str__(self) -> str:
        """Write each error on its own line and count them at the end."""
        shown = f", the first {len(self.errors):,} are listed" if self.unlisted else ""
        return "\n".join([*map(str, self.errors), f"{self.message}{shown}."])

    def __reduce__(self) -> tuple[object, ...]:
        """Keep the list when the error crosses a process boundary."""
        return partial(InputErrors, unlisted=self.unlisted), (self.errors,)


def raise_all(errors: Sequence[InputError], *, unlisted: int = 0) -> None:
    """Raise input errors as one, if there are any.

    Args:
        errors: Those to list.
        unlisted: How many more there are.

    Raises:
        InputError: The only one.
        InputErrors: All of several.
    """
    if len(errors) == 1 and not unlisted:
        raise errors[0]
    if errors:
        raise InputErrors(errors, unlisted=unlisted)


class Together:
    """Collects the input errors of steps that do not build on each other, and raises them as one.

    >>> together = Together()
    >>> for text in ("slow", "20 m/s"):
    ...     with together:
    ...         if text == "slow":
    ...             raise UnitError(f"{text} has no unit")
    >>> together.finish()
    Traceback (most recent call last):
    adeye.errors.UnitError: UnitError: slow has no unit.
    """

    def __init__(self) -> None:
        self._errors: dict[str, InputError] = {}
        self._unlisted = 0

    def __enter__(self) -> None:
        """Begin a step."""

    def __exit__(self, _kind: object, error: BaseException | None, _where: object) -> bool:
        """End it and keep an input error; one and the same of two steps counts once."""
        if isinstance(error, InputErrors):
            self._errors |= {str(item): item for item in error.errors}
            self._unlisted += error.unlisted
        elif isinstance(error, InputError):
            self._errors.setdefault(str(error), error)
        return isinstance(error, InputError)

    def finish(self) -> None:
        """Raise what was kept, if anything was.

        Raises:
            InputError: The only one.
            InputErrors: All, in the order of the steps.
        """
        raise_all([*self._errors.values()], unlisted=self._unlisted)


@contextmanager
def needing(what: str, extra: str, *, otherwise: str = "") -> Iterator[None]:
    """Say which extra is missing where an import within fails.

    Args:
        what: What needs it, see ``MissingExtra.of``.
        extra: Name of the extra.
        otherwise: What can be done without it.

    Raises:
        MissingExtra: It, or something that it needs in turn, is not installed.
        ImportError: A module of our own cannot be imported, which is a defect.
    """
    try:
        yield
    except ImportError as error:
        if (error.name or "").partition(".")[0] == "adeye":
            raise
        raise MissingExtra.of(what, extra, otherwise=otherwise) from error


@contextmanager
def placed(
    where: SourceLocation | None,
    before: str = "",
    *,
    caught: type[InputError] = SpecError,
    raised: type[InputError] = SpecError,
    keeps_place: bool = False,
) -> Iterator[None]:
    """Say of an error that is raised in here where what it is about was written.

    Args:
        where: That place.
        before: What stands before the message.
        caught: Kind of errors that this is said of.
        raised: Kind that they become.
        keeps_place: Whether one that has a place stays as it is.
    """
    try:
        yield
    except caught as error:
        if keeps_place and error.where is not None:
            raise
        raise raised(f"{before}{error.message}", where=where, remedy=error.remedy) from error


class PlatformError(AdeyeError):
    """The database, the disk or the machine did not do its part."""

    exit_code = 5


class LostConnection(PlatformError):  # noqa: N818 - what happened, not who erred
    """The connection to a database server was lost, or there is none at the moment."""


class UnfitWorker(PlatformError):  # noqa: N818 - what it is, not who erred
    """A worker elsewhere has not what the plan was made with; others may have.

    Attributes:
        why: What it lacks, without the rest of the message.
    """

    why = ""


class IntegrityError(AdeyeError):
    """Stored evidence does not agree with itself."""

    exit_code = 4


class PluginError(AdeyeError):
    """Code from outside raised where no run can record it."""

    exit_code = 3


def code_of(error: AdeyeError) -> int:
    """Return the exit code of what an error is here: a class of a guest cannot choose one."""
    # What a guest's class, or its metaclass, says of itself is not asked.
    own = (kind for kind in type.mro(type(error)) if id(kind) in map(id, globals().values()))
    return next(kind.exit_code for kind in own if issubclass(kind, AdeyeError))


class Terminated(BaseException):
    """The process was asked to end (SIGTERM)."""


class Interrupted(KeyboardInterrupt):
    """The process was asked to end (SIGINT), and no code from outside raised this."""


ASKED_TO_END: Final = (KeyboardInterrupt, Terminated)
"""What ends a campaign where somebody asked for it; ``supervision.is_asked`` tells."""


def amount(count: int, one: str, many: str = "") -> str:
    """Write how many there are of something.

    Args:
        count: How many.
        one: What it is called, and of one what it does.
        many: The same of several; default: ``one`` with an s.

    >>> amount(1, "gap"), amount(1512, "gap"), amount(0, "entry", "entries")
    ('1 gap', '1,512 gaps', '0 entries')
    """
    return f"{count:,} {one if count == 1 else many or f'{one}s'}"


def suggest(word: str, allowed: Iterable[str]) -> str:
    """Name the nearest allowed word, or all of them.

    >>> suggest("cut_inn", ["cut_in", "cut_out"])
    "Did you mean 'cut_in'?"
    >>> suggest("x", ["cut_in", "cut_out"])
    'Allowed: cut_in, cut_out.'
    """
    known = list(allowed)
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    if near:
        return f"Did you mean {near[0]!r}?"
    if not known:
        return "Nothing is allowed here."
    return f"Allowed: {', '.join(known)}."


def require_known(
    names: Iterable[str],
    allowed: Collection[str],
    said: Callable[[str], str],
    error: type[InputError] = UsageError,
) -> None:
    """Refuse the first name that is not among the allowed ones, and name the nearest of them."""
    for name in names:
        if name not in allowed:
            raise error(said(name), remedy=suggest(name, allowed))
