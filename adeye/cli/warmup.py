"""``warmup``: compile now what the first run would otherwise compile."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

import typer

from adeye.cli.options import Backend, Json, Quiet, Variant
from adeye.cli.output import clean, emit, emit_json
from adeye.cli.progress import duration, reporting

SHIPPED: Final = ("motorway_chauffeur.yaml", "urban_pedestrian_rain.yaml")
"""ODDs of the package whose kernels are compiled where none is named."""

OddFiles = Annotated[
    list[Path] | None,
    typer.Argument(metavar="[ODD]...", help="ODD files; by default those that come with adeye."),
]


def warmup(
    odds: OddFiles = None,
    backend: Backend = "batch",
    variant: Variant = None,
    quiet: Quiet = False,
    json: Json = False,
) -> None:
    """Compile the kernels that ODDs need, and keep the machine code for every later run.

    One test case of each structure is executed and judged; its results are thrown away. Useful in
    the build of a container image and before a demonstration.
    """
    from adeye.campaign.plan import make_plan
    from adeye.campaign.warmup import warm_up
    from adeye.kernel.jit import cache_directory
    from adeye.spec.load import shipped

    taken = 0.0
    files = odds or [shipped("odd") / name for name in SHIPPED]
    for odd in files:
        plan = make_plan(odd, backend=backend, variant=variant)
        with reporting(f"compile for {odd.name}", quiet=quiet) as progress:
            taken += warm_up(plan, progress)
    if json:
        emit_json("warmup", {"odds": files, "seconds": taken, "folder": cache_directory()})
    else:
        emit(clean(f"Compiled in {duration(taken)}, kept in {cache_directory()}"))
