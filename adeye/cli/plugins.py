"""``plugins``: parts from outside the package, offered and named; nothing is imported."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from adeye.cli.options import Json
from adeye.cli.output import emit, emit_json, emit_table, short

OfOdd = Annotated[
    Path | None,
    typer.Argument(
        metavar="[ODD]", help="Whose plug-ins to list; default: only what packages offer."
    ),
]


def plugins(odd: OfOdd = None, json: Json = False) -> None:
    """List plug-ins: what installed packages offer, and what an ODD names. None is imported.

    A plug-in is code with all rights of who runs it. It is loaded only when a file that is planned
    or a stored run that is executed again names it.
    """
    from adeye.campaign.plugins import named, offered
    from adeye.spec.load import load_odd

    used = () if odd is None else named(load_odd(odd))
    found = offered()
    if json:
        emit_json("plugins", {"offered": found, "named": used})
        return
    if found:
        emit_table(
            ("Kind", "Name", "Package", "Version", "Write it as"),
            [(item.kind, item.name, item.package, item.version, item.source) for item in found],
            title="Offered by packages",
        )
    else:
        emit("No installed package offers a plug-in.")
    if odd is None:
        return
    if used:
        emit_table(
            ("Kind", "Plug-in", "Code", "Named by"),
            [
                (item.kind, item.source, short(item.digest) if item.digest else "not found",
                 item.owner)
                for item in used
            ],
            title="Named by the ODD and its architectures",
        )  # fmt: skip
    else:
        emit("The ODD names no plug-in.")
