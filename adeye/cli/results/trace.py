"""``trace|plot``: the signals of one run over time, as a table and as a picture."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from adeye.cli import options as opt
from adeye.cli import output as out
from adeye.cli.results.runs import LastFailed, RunName, Worst, run_called
from adeye.errors import UsageError, needing
from adeye.outputs import replacing, write_atomically

if TYPE_CHECKING:
    from collections.abc import Iterator

    from adeye.report.formats.signals import Drawing
    from adeye.report.page.replay import SignalPlot

PICTURE: Final = ".svg"
_HEIGHT: Final = 12
"""Lines that a picture in the terminal takes."""
_WIDEST: Final = 100
_BESIDE: Final = 24
"""Columns that the axis of a picture in the terminal takes."""


def trace(
    run: RunName = None,
    *,
    worst: Worst = None,
    last_failed: LastFailed = False,
    signal: Annotated[list[str] | None, opt.option("--signal -s GLOB")] = None,
    output: Annotated[
        Path | None, opt.option("--output -o FILE", env="TRACE_OUTPUT", callback=opt.named)
    ] = None,
    db: opt.Db = None,
    json: opt.Json = False,
) -> None:
    """Give the signals of a run over time: a row a tick, a column for all that formulas may name.

    A kept trace is read; without one the run is executed again, and refused unless its trace is the
    stored one. Without --output it is printed as CSV. Names, units and words of the columns are
    those of 'adeye signals', so that 'adeye stl' judges what is written; a column NAME.status says
    why samples are no values.

    Parameters:
        signal: Name of a signal, in which * and ? stand for others, such as 'ego.*'; may be
            repeated. Default: all.
        output: File in .parquet, .csv, .jsonl or .npz.

    Examples:
        adeye trace 3f2a91c04b -o run.parquet
        adeye trace 3f2a91c04b --signal 'ego.*' --signal ttc
        adeye trace --worst FSR-02 -o run.parquet
    """
    from adeye.report.formats.traces import document, form_of, write_trace_table
    from adeye.reporting import trace_run

    form = None if output is None else form_of(output)
    called = run_called(db, run, worst, last_failed=last_failed)
    found = trace_run(db, called, signal or ())
    if output is not None and form is not None:
        with replacing(output) as place:
            write_trace_table(found, place, form)
    if json:
        out.emit_json("trace", document(found))
    elif output is None:
        out.emit_csv(found.titles, found.rows)
    if output is not None:
        out.wrote(output)
    if form in {None, "csv", "jsonl"} and not json:
        out.talk(
            f"note: obligations of FSRs begin up to {found.horizon}, which 'adeye stl' is told by "
            f"--horizon '{found.horizon}'"
        )


def plot(
    words: Annotated[list[str], typer.Argument(metavar="[RUN] SIGNAL...", show_default=False)],
    *,
    worst: Worst = None,
    last_failed: LastFailed = False,
    output: Annotated[
        Path | None, opt.option("--output -o FILE", env="PLOT_OUTPUT", callback=opt.named)
    ] = None,
    db: opt.Db = None,
) -> None:
    """Draw signals of a run over time, with the limits that FSRs set on them and what happened.

    Without --output they are drawn in the terminal, which needs adeye[plot].

    Parameters:
        words: Beginning of the run's digest, then names of signals, in which * and ? stand for
            others.
        output: Picture in .svg.

    Examples:
        adeye plot 3f2a91c04b ttc ego.speed -o run.svg
        adeye plot --worst FSR-02 'authority.*'
    """
    from adeye.reporting import draw_run

    if output is None:
        _require_library()
    elif output.suffix.lower() != PICTURE:
        raise UsageError(
            f"{str(output)!r} does not end in {PICTURE}", remedy="A browser prints it as PDF."
        )
    is_digest = worst is None and not last_failed
    run, signals = (words[0], words[1:]) if is_digest else (None, words)
    if not signals:
        raise UsageError("which signals?", remedy="'adeye signals ODD' lists them.")
    called = run_called(db, run, worst, last_failed=last_failed)
    drawing = draw_run(db, called, signals)
    if output is None:
        out.emit(out.clean(drawing.title))
        for item in drawing.plots:
            out.emit("")
            out.emit(out.clean("\n".join(_lines(item, drawing)), lines=True))
        return
    from adeye.report.formats.signals import draw_signals

    write_atomically(draw_signals(drawing), output)
    out.wrote(output)


def _require_library() -> None:
    """Import what draws in the terminal.

    Raises:
        MissingExtra: It is not installed.
    """
    remedy = "name a file: --output run.svg"
    with needing("a picture in the terminal", "plot", otherwise=remedy):
        import plotille  # noqa: F401 - whether it is there


def _lines(plot: SignalPlot, drawing: Drawing) -> Iterator[str]:
    """Draw a signal in the terminal: numbers as a curve, of words when each begins."""
    from adeye.report.formats.signals import limit_text

    named = f"{plot.name} [{plot.unit}]" if plot.unit else plot.name
    limits = ", ".join(limit_text(item, plot.unit) for item in plot.thresholds)
    yield f"{named}, {limits}" if limits else named
    samples = list(zip(drawing.time_s, plot.values, strict=True))
    if all(value is None for _, value in samples):
        yield "no value"
    elif plot.labels:
        parts = ((key, next(part)[0]) for key, part in groupby(samples, lambda item: item[1]))
        words = (("no value" if key is None else plot.labels[round(key)], at) for key, at in parts)
        yield ", ".join(f"{word} from {at:g} s" for word, at in words)
    else:
        yield _curve([(at, value) for at, value in samples if value is not None], plot, drawing)


def _curve(known: list[tuple[float, float]], plot: SignalPlot, drawing: Drawing) -> str:
    """Draw the values of a number; what has none leaves a gap."""
    from plotille import Figure

    from adeye.report.formats.signals import marks_of

    times, values = zip(*known, strict=True)
    marks = marks_of(plot, values)
    figure = Figure()
    figure.width, figure.height = max(20, min(_WIDEST, out.width()) - _BESIDE), _HEIGHT
    figure.with_colors = figure.origin = False
    figure.x_label, figure.y_label = "s", plot.unit
    figure.x_ticks_fkt = figure.y_ticks_fkt = lambda value, _: f"{value:.3g}"
    figure.set_x_limits(drawing.time_s[0], drawing.time_s[-1])
    figure.set_y_limits(marks[0], marks[-1])
    figure.scatter(times, values)
    return str(figure.show())
