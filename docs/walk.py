"""Execute the console blocks of pages in a scratch project; compare what they print, or renew it.

    PAGES='README.md docs/guide/*.md docs/cookbook.md'
    python -m docs.walk $PAGES             compare
    python -m docs.walk --update $PAGES    write what was printed into the pages

In a console block, a line that begins with ``$`` is a command, ``>`` continues it, and what follows
is its output. A line ``…`` stands for lines left out. A Python block is executed, too, and a text
block right after it is what it prints. A block after ``<!-- file PATH -->`` is that file.

Pages are walked in the order given, in one project that begins as a copy of ``odd/`` and
``scenarios_db/``. The page about teams needs a PostgreSQL server, in ``PGHOST`` and ``PGUSER``,
with a database ``team`` and a user ``ada``. Of a page, first the files are written, then the
console blocks are executed, then the Python blocks. Digests, dates, sizes and versions of
highway-env are not compared, everything else character by character.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from docs.served import serving

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

ROOT = Path(__file__).resolve().parent.parent
COPIED = ("odd", "scenarios_db")
LEFT_OUT = "…"
TIMEOUT_S = 600.0

_BLOCK = re.compile(r"^```console\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_FILE = re.compile(r"^<!-- file (\S+) -->\n```\w+\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_PYTHON = re.compile(
    r"^```python\n(.*?)^```$(?:\n\n```text\n(.*?)^```$)?", re.MULTILINE | re.DOTALL
)
_MARK = "\x1e"
_MASKS = (
    (re.compile(r"\b[0-9a-f]{10,64}\b"), "#"),
    (re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+(?:\+00:00)?"), "DATE"),
    (re.compile(r"highway-env-[\d.]+"), "highway-env"),
    (re.compile(r"\b\d+(?:\.\d+)? [kM]B\b"), "SIZE"),
)


@dataclass(frozen=True)
class Command:
    """A command with the output that the page shows.

    Attributes:
        lines: As written, without the prompt.
        shown: Lines of output on the page.
        printed: Lines that it printed when it was executed.
    """

    lines: tuple[str, ...]
    shown: tuple[str, ...]
    printed: tuple[str, ...] = field(default=())

    @property
    def text(self) -> str:
        """What the shell is given."""
        return "\n".join(self.lines)

    def differs(self) -> str:
        """Say how the printed lines differ from the shown ones; empty if they do not."""
        rest = [_masked(line) for line in self.printed]
        parts = [[_masked(line) for line in part] for part in _parts(self.shown)]
        for number, part in enumerate(parts):
            is_last = number == len(parts) - 1
            places = range(len(rest) - len(part) + 1)
            if number == 0:
                places = places[:1]
            if is_last:
                places = places[-1:] if number else places[: int(len(rest) == len(part))]
            place = next((k for k in places if rest[k : k + len(part)] == part), None)
            if place is None:
                printed = "\n".join(self.printed)
                return f"$ {self.text}\nis shown with\n{_joined(part)}\nbut printed\n{printed}"
            rest = rest[place + len(part) :]
        return ""

    def renewed(self) -> Iterator[str]:
        """Write the command with what it printed, leaving out as many lines as before."""
        yield f"$ {self.lines[0]}"
        yield from (f"> {line}" for line in self.lines[1:])
        parts = _parts(self.shown)
        if len(parts) == 1 or sum(map(len, parts)) >= len(self.printed):
            yield from self.printed
            return
        yield from self.printed[: len(parts[0])]
        yield LEFT_OUT
        yield from self.printed[len(self.printed) - len(parts[-1]) :]


def commands_of(text: str) -> list[list[Command]]:
    """Read the console blocks of a page."""
    return [_commands(match[1].splitlines()) for match in _BLOCK.finditer(text)]


def _commands(lines: Sequence[str]) -> list[Command]:
    found: list[tuple[list[str], list[str]]] = []
    for line in lines:
        if line.startswith("$ "):
            found.append(([line[2:]], []))
        elif line.startswith("> ") and found and not found[-1][1]:
            found[-1][0].append(line[2:])
        elif found:
            found[-1][1].append(line.rstrip())
        else:
            msg = f"a console block begins with {line!r}, not with a command"
            raise ValueError(msg)
    return [Command(tuple(command), tuple(shown)) for command, shown in found]


def _parts(shown: Sequence[str]) -> list[list[str]]:
    parts: list[list[str]] = [[]]
    for line in shown:
        if line == LEFT_OUT:
            parts.append([])
        else:
            parts[-1].append(line)
    return parts


def _masked(line: str) -> str:
    for pattern, word in _MASKS:
        line = pattern.sub(word, line)
    return line.rstrip()


def _joined(lines: Sequence[str]) -> str:
    return "\n".join(lines)


class Walk:
    """A scratch project with ``adeye`` and the ``python`` of it on its path."""

    def __init__(self, folder: Path) -> None:
        """Make the project.

        Args:
            folder: An empty folder.
        """
        self.project = folder / "project"
        for name in COPIED:
            shutil.copytree(ROOT / name, self.project / name)
        self._bin = folder / "bin"
        self._bin.mkdir()
        python = shlex.quote(sys.executable)
        self.put("python", python)
        self.put("adeye", f"{python} -m adeye")

    def put(self, name: str, started: str) -> None:
        """Put a program on the path that starts another one."""
        program = self._bin / name
        program.write_text(f'#!/bin/sh\nexec {started} "$@"\n')
        program.chmod(0o755)

    @property
    def environment(self) -> dict[str, str]:
        """What the commands see: no settings of the caller, no colours, lines of any length."""
        kept = {
            name: value
            for name, value in os.environ.items()
            if not name.startswith("ADEYE_") and name not in {"COLUMNS", "PYTHONPATH"}
        }
        return kept | {
            "PATH": f"{self._bin}{os.pathsep}{kept.get('PATH', '')}",
            "PYTHONPATH": str(ROOT),
            "TERM": "dumb",
            "NO_COLOR": "1",
        }

    def execute(self, blocks: Sequence[Sequence[Command]]) -> list[list[Command]]:
        """Execute the blocks of one page in one shell and return them with what they printed."""
        flat = [command for block in blocks for command in block]
        # Each command sees the exit status of the one before.
        script = "".join(
            f"__code=$?; printf '{_MARK}\\n'; (exit $__code)\n{command.text}\n" for command in flat
        )
        done = subprocess.run(
            ["/bin/bash"],
            input=script,
            capture_output=True,
            text=True,
            cwd=self.project,
            env=self.environment,
            timeout=TIMEOUT_S,
            check=False,
        )
        pieces = done.stdout.split(f"{_MARK}\n")[1:]
        if len(pieces) != len(flat):
            msg = f"{len(flat)} commands printed {len(pieces)} outputs:\n{done.stderr}"
            raise RuntimeError(msg)
        printed = iter(pieces)
        return [
            [
                replace(item, printed=tuple(x.rstrip() for x in next(printed).splitlines()))
                for item in block
            ]
            for block in blocks
        ]

    def write(self, files: Mapping[str, str]) -> None:
        """Write files into the project."""
        for name, content in files.items():
            path = self.project / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, "utf-8")

    def python(self, source: str) -> str:
        """Execute a Python block in the project and return what it printed."""
        done = subprocess.run(
            [sys.executable, "-W", "error", "-"],
            input=source,
            capture_output=True,
            text=True,
            cwd=self.project,
            env=self.environment,
            timeout=TIMEOUT_S,
            check=False,
        )
        if done.returncode:
            msg = f"the block ended with {done.returncode}:\n{source}\n{done.stderr}"
            raise RuntimeError(msg)
        return done.stdout


@dataclass(frozen=True)
class Walked:
    """A page with what its blocks printed.

    Attributes:
        page: Its file.
        blocks: Console blocks.
        scripts: Python blocks.
    """

    page: Path
    blocks: Sequence[Sequence[Command]]
    scripts: Sequence[Command]

    def differences(self) -> Iterator[str]:
        """Say where the page shows what was not printed."""
        for command in (*(item for block in self.blocks for item in block), *self.scripts):
            difference = command.differs()
            if difference:
                yield difference

    def renewed(self) -> str:
        """Write the page with what was printed."""
        blocks, scripts = iter(self.blocks), iter(self.scripts)

        def console(_: re.Match[str]) -> str:
            lines = [line for command in next(blocks) for line in command.renewed()]
            return _joined(["```console", *lines, "```"])

        def python(match: re.Match[str]) -> str:
            if _is_file(match):
                return match[0]
            script = next(scripts)
            shown = [] if match[2] is None else ["", "```text", *script.printed, "```"]
            return _joined(["```python", *script.lines, "```", *shown])

        text = self.page.read_text("utf-8")
        return _PYTHON.sub(python, _BLOCK.sub(console, text))


def files_of(text: str) -> dict[str, str]:
    """Read the files that a page writes, by path."""
    return {match[1]: match[2] for match in _FILE.finditer(text)}


def scripts_of(text: str) -> list[Command]:
    """Read the Python blocks of a page that are executed."""
    return [
        Command(tuple(match[1].splitlines()), tuple((match[2] or "").splitlines()))
        for match in _PYTHON.finditer(text)
        if not _is_file(match)
    ]


def _is_file(match: re.Match[str]) -> bool:
    return match.string[: match.start()].endswith(" -->\n")


def walk(pages: Sequence[Path], folder: Path, *, beside: Sequence[Path] = ()) -> list[Walked]:
    """Execute the blocks of pages, one page after the other, in one project.

    Args:
        pages: The pages.
        folder: An empty folder, for the project.
        beside: Pages whose files are there, too.
    """
    scratch = Walk(folder)
    for page in beside:
        scratch.write(files_of(page.read_text("utf-8")))
    with serving(folder) as command:
        scratch.put("adeye", command)
        return [_walked(scratch, page) for page in pages]


def _walked(scratch: Walk, page: Path) -> Walked:
    text = page.read_text("utf-8")
    scratch.write(files_of(text))
    blocks = scratch.execute(commands_of(text))
    scripts = [
        replace(item, printed=tuple(scratch.python(item.text + "\n").splitlines()))
        for item in scripts_of(text)
    ]
    return Walked(page, blocks, scripts)


def main(arguments: Sequence[str]) -> int:
    """Compare or renew pages; returns the exit code."""
    pages = [Path(name) for name in arguments if not name.startswith("-")]
    with tempfile.TemporaryDirectory(prefix="adeye-walk-") as folder:
        walked = walk(pages, Path(folder))
    code = 0
    for item in walked:
        if "--update" in arguments:
            item.page.write_text(item.renewed(), "utf-8")
            continue
        for difference in item.differences():
            sys.stderr.write(f"{item.page}: {difference}\n")
            code = 1
    return code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
