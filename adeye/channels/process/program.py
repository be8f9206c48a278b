"""From the command of an architecture to what is executed: a program and files of the project."""

from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Final

from adeye.errors import SpecError
from adeye.registry import locate_file
from adeye.units import shown

if TYPE_CHECKING:
    from collections.abc import Sequence

HERE: Final = "./"
"""How a word of a command begins that names a file of the project."""


def command_files(command: Sequence[str]) -> dict[int, str]:
    """Return the words of a command that name files of the project, by their place."""
    return {at: word for at, word in enumerate(command) if word.startswith(HERE)}


def find_program(command: Sequence[str], base_dir: Path) -> tuple[str, ...]:
    """Turn a command into what is executed: files by their absolute paths.

    Args:
        command: As the user wrote it.
        base_dir: Folder of the file that names it.

    Returns:
        Path of the program and its arguments.

    Raises:
        SpecError: This system cannot do it, there is no such program, it cannot be executed, or a
            file lies outside of the folder.
    """
    if os.name != "posix":
        raise SpecError(
            "kind process needs a POSIX system, such as Linux",
            remedy="Run it there, or write the channel as ./file.py:Class.",
        )
    paths = {at: str(locate_file(word, base_dir)) for at, word in command_files(command).items()}
    if not paths:
        raise SpecError(
            f"the command {shown(' '.join(command))} names no file of the project",
            remedy="Write the program, or the script that it executes, as ./file beside this file:"
            " its content is part of a result's identity.",
        )
    name = command[0]
    if 0 in paths:
        if not os.access(paths[0], os.X_OK):
            raise SpecError(
                f"{shown(name)} cannot be executed",
                remedy=f"chmod +x {name}, or name its interpreter first.",
            )
    elif "/" in name:
        raise SpecError(
            f"{shown(name)} is neither a file of the project nor the name of a program",
            remedy="Write ./file relative to this file, or a name that is found on the PATH.",
        )
    else:
        found = shutil.which(name)
        if found is None:
            raise SpecError(
                f"there is no program {shown(name)} on the PATH",
                remedy="Install it, or name ./file.",
            )
        paths[0] = str(Path(found).absolute())
    return tuple(paths.get(at, word) for at, word in enumerate(command))
