"""Standard output kept for results: what code from outside prints goes to standard error."""

from __future__ import annotations

import io
import os
import sys
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Final, TextIO

from adeye.outputs import laid

if TYPE_CHECKING:
    from collections.abc import Iterator

_STDOUT: Final = 1
_apart: list[TextIO] = []


def results() -> TextIO | None:
    """Return the stream that results are written to."""
    return _apart[-1] if _apart else sys.stdout


class _Shared(io.TextIOWrapper):
    """A stream of all code from outside: who closes it leaves it to the others."""

    def close(self) -> None:
        """Write what is still to be written."""
        self.flush()


@contextmanager
def results_apart() -> Iterator[None]:
    """Give results a stream of their own, and lay standard output onto standard error.

    A plug-in that prints, or a library below it, cannot get between the lines of a document; nor
    can one that closes its output. Worker processes inherit what is laid here. Where the streams
    are no files, as in a notebook, nothing changes.
    """
    normal = sys.stdout
    if _apart or normal is None or sys.stderr is None:
        yield
        return
    try:
        error, outputs = sys.stderr.fileno(), {normal.fileno(), _STDOUT}
        normal.flush()
        kept = {output: os.dup(output) for output in outputs}
    except (OSError, ValueError):
        yield
        return
    own = os.dup(kept[normal.fileno()])
    with open(own, "w", encoding=normal.encoding, errors=normal.errors) as stream:  # noqa: PTH123 - a descriptor
        _apart.append(stream)
        for output in outputs:
            os.dup2(error, output)
        laid.update(dict.fromkeys(outputs, own))
        printed = open(os.dup(error), "wb")  # noqa: PTH123, SIM115 - a descriptor
        sys.stdout = _Shared(printed, normal.encoding, normal.errors, line_buffering=True)
        try:
            yield
        finally:
            sys.stdout = normal
            printed.close()
            laid.clear()
            _apart.pop()
            # One that was closed meanwhile may be somebody else's by now.
            with suppress(OSError, ValueError):
                normal.flush()
            for output, before in kept.items():
                if _is_same(output, error):
                    os.dup2(before, output)
                os.close(before)


def _is_same(one: int, other: int) -> bool:
    """Tell whether two descriptors are of one file."""
    with suppress(OSError):
        return os.path.samestat(os.fstat(one), os.fstat(other))
    return False
