"""``preventability|reference``: what a reference driver would have avoided."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from adeye.cli import output as out
from adeye.cli.options import Db, Json, Quiet, named, option, write_rows
from adeye.cli.progress import watching
from adeye.errors import amount

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.analysis.reference_cases import Floats, Question
    from adeye.campaign.studies.preventability import Preventability
    from adeye.judge.preventability import Cell, Comparison

# --- ``reference``: which scenes of a CSV file the reference drivers of UN R157 master ------------


EditionName = Annotated[
    str, option("NAME", help="Rules: r157, r157-01, eu-2022-1426 or eu-2022-1426-standing.")
]


def reference(
    cases: Annotated[Path, typer.Argument(metavar="CASES")],
    *,
    models: Annotated[str, option("NAMES")] = "cc,fsm,rss,reg157",
    edition: EditionName = "r157-01",
    variant: Annotated[str, option("NAMES", env="REFERENCE_VARIANT")] = "",
    scene: Annotated[str, option("KIND")] = "cut_in",
    step: Annotated[float, option("SECONDS")] = 0.01,
    integrator: Annotated[str, option("NAME")] = "exact",
    output: Annotated[Path | None, option("-o --output FILE", callback=named)] = None,
    json: Json = False,
) -> None:
    """Let the reference drivers of UN R157 drive scenes, without a campaign.

    Cut-in, cut-out and braking lead, in closed form or tick by tick: for each scene and driver
    whether there is a contact, at what speed, and the least gap. A benchmark, not a proof: that a
    model avoids a contact does not tell that a driver would.

    Parameters:
        cases: CSV file with a header and one scene per row.
        models: Reference drivers, with commas between: cc, fsm, rss, reg157.
        variant: Differences of code to the text, with commas between; jrc, esmini: all of one.
        scene: What the rows are: cut_in, cut_out or deceleration.
        step: Length of a tick, 0.001 to 0.1 s.
        integrator: exact, or semi-implicit as in the published code.
        output: Write one row per scene with contact and impact speed of each model.

    Examples:
        adeye reference cases.csv
        adeye reference cases.csv --models cc,fsm --edition r157-01 --variant jrc -o result.csv
        adeye reference leads.csv --scene deceleration --step 0.1 --integrator semi-implicit
    """
    from adeye.analysis.reference_cases import (
        Question,
        answers,
        check_question,
        drive,
        obligations,
        read,
    )
    from adeye.campaign.run import Progress

    question = Question(
        scene=scene,
        models=names_in(models),
        edition=edition,
        variant=names_in(variant),
        step=step,
        integrator=integrator,
    )
    check_question(question)
    rows, scenes = read(cases, scene)
    header = [] if output is None else [*rows[0], *answers(cases, rows[0], question)]
    done, total = 0, len(scenes) * len(question.models)
    results: dict[str, Floats] = {}
    with watching() as report:

        def told(count: int) -> None:
            nonlocal done
            done += count
            report(Progress("driving scenes", done, total, 0))

        for model in question.models:
            results[model] = drive(scenes, question, model, threads=os.cpu_count() or 1, told=told)
    duty = obligations(scenes, edition) if scene == "cut_in" else None
    _warn(scenes, edition)
    if output is not None:
        _write(output, header, rows, results, duty)
        out.wrote(output)
    if json:
        out.emit_json("reference", _document(question, results, duty))
    else:
        _print_reference(question, results, duty)


def names_in(text: str) -> tuple[str, ...]:
    """Return the names between the commas, each once."""
    return tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))


def _warn(scenes: Floats, edition: str) -> None:
    from adeye.kernel.reference_drivers.reactions import EDITIONS, S_EGO_SPEED

    rules = EDITIONS[edition]
    count = int((scenes[:, S_EGO_SPEED] > rules.highest_speed * (1.0 + 1e-9)).sum())
    if count:
        limit = rules.highest_speed * 3.6
        out.talk(
            f"{count} of {len(scenes)} scenes are faster than {limit:.0f} km/h, beyond {edition}"
        )


def _word(value: float) -> str:
    """Return what a mark of 1, 0 or NaN says."""
    return "undecided" if value != value else ("yes" if value else "no")  # noqa: PLR0124 - NaN


def _cells(result: Sequence[float]) -> list[str]:
    contact, speed, gap, braking = (float(value) for value in result)
    return [
        _word(contact),
        "" if speed != speed else f"{speed:.6g}",  # noqa: PLR0124 - NaN
        "" if gap == float("inf") else f"{gap:.6g}",
        "" if braking != braking else f"{braking:.6g}",  # noqa: PLR0124 - NaN
    ]


def _write(
    path: Path,
    header: Sequence[str],
    rows: Sequence[Mapping[str, str]],
    results: Mapping[str, Floats],
    duty: Floats | None,
) -> None:
    lines = []
    for k, row in enumerate(rows):
        line = [*row.values()]
        for result in results.values():
            line += _cells(result[k])
        lines.append(line if duty is None else [*line, _word(duty[k])])
    write_rows(header, lines, path)


def _counts(results: Mapping[str, Floats], duty: Floats | None) -> list[dict[str, Any]]:
    counts = []
    for model, result in results.items():
        contact = result[:, 0] == 1.0
        counts.append(
            {
                "model": model,
                "scenes": len(result),
                "contacts": int(contact.sum()),
                "undecided": int((result[:, 0] != result[:, 0]).sum()),
                "must_be_avoided": None if duty is None else int((duty == 1.0).sum()),
                "contacts_against_the_rule": (
                    None if duty is None else int((contact & (duty == 1.0)).sum())
                ),
            }
        )
    return counts


def _document(
    question: Question, results: Mapping[str, Floats], duty: Floats | None
) -> dict[str, Any]:
    marks = {1.0: True, 0.0: False}
    cases = []
    for k in range(len(next(iter(results.values())))):
        case: dict[str, Any] = {
            model: {
                "contact": marks.get(float(result[k, 0])),
                "impact_speed_mps": float(result[k, 1]),
                "min_gap_m": float(result[k, 2]),
                "braking_time_s": float(result[k, 3]),
            }
            for model, result in results.items()
        }
        if duty is not None:
            case["must_be_avoided"] = marks.get(float(duty[k]))
        cases.append(case)
    return {
        "scene": question.scene,
        "edition": question.edition,
        "variant": list(question.variant),
        "step_s": question.step,
        "integrator": question.integrator,
        "models": _counts(results, duty),
        "cases": cases,
    }


def _print_reference(
    question: Question, results: Mapping[str, Floats], duty: Floats | None
) -> None:
    counts = _counts(results, duty)
    names = [name for name in counts[0] if counts[0][name] is not None]
    headers = [name.replace("_", " ") for name in names]
    out.emit_table(
        headers,
        [[count[name] for name in names] for count in counts],
        title=", ".join((f"{question.scene} by {question.edition}", *question.variant)),
        right=headers[1:],
    )
    out.emit("A benchmark, not a proof: what no model masters may still be avoidable.")


# --- ``preventability``: would a reference driver have avoided what the architecture did not? -----

SHOWN: Final = 20
"""Findings that are listed; JSON has all."""

_WORDS: Final[Mapping[Cell, str]] = {
    "both_avoid": "Both avoid",
    "only_ours": "Only ours",
    "only_model": "Only the model",
    "neither": "Neither",
    "unknown": "Unknown",
}


def preventability(
    name: Annotated[str | None, typer.Argument(metavar="RUN|CAMPAIGN")] = None,
    *,
    model: Annotated[str, option("NAMES", env="MODELS")] = "cc",
    edition: EditionName = "r157-01",
    threshold: Annotated[str | None, option("DECELERATION")] = None,
    everything: Annotated[bool, option("--all")] = False,
    workers: Annotated[int, option("N", min=1, max=64)] = 1,
    db: Db = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Let reference drivers of UN R157 drive the conflicts of a campaign, and say who avoids them.

    A conflict is a contact, or a required deceleration beyond the threshold. The driver has the
    same vehicle in the same situation, sees it as it is, and has no faults, since it has no such
    parts. What only the model avoids is a finding. A benchmark, not a proof.

    Exit codes: 0 done, also with findings; 2 no such run, campaign, model or edition; 3 no run has
    a conflict; 4 a result contradicts the database.

    Parameters:
        name: Campaign by id, its beginning or its number, or the beginning of a run's digest; the
            newest campaign by default.
        model: Reference drivers, with commas between: cc, fsm, rss, reg157.
        threshold: Required deceleration, such as '4 m/s^2', beyond which a run without a contact
            has a conflict; by default the full braking of the model.
        everything: Drive the situation of every run, also where nothing happened.
        workers: Batches that are executed at once.

    Examples:
        adeye preventability
        adeye preventability 3 --model cc,fsm --json
        adeye preventability 3f2a91c04b --model rss --threshold '4 m/s^2'
    """
    from adeye.campaign.studies.preventability import prevent
    from adeye.errors import UsageError
    from adeye.units import Dimension, parse_quantity

    limit = None if threshold is None else parse_quantity(threshold, Dimension.ACCELERATION)
    if limit is not None and not limit > 0.0:
        raise UsageError(
            f"--threshold {threshold}: every run requires more than that",
            remedy="Give a deceleration above zero.",
        )
    with watching(quiet=quiet) as report:
        found = prevent(
            db,
            name,
            models=names_in(model),
            edition=edition,
            threshold=limit,
            everything=everything,
            workers=workers,
            report=report,
        )
    out.emit_found(
        "preventability",
        found,
        _print_preventability,
        json=json,
        document=lambda found: {"edition": edition, **out.plain(found)},
        looked_at=len(found.comparisons),
    )


def _print_preventability(found: Preventability) -> None:
    for model, count in found.looked_at.items():
        what = f" (contact, or more than {found.threshold_mps2[model]:.2f} m/s² required)"
        runs = f"{count} of {found.executed} runs driven by {model}"
        out.emit(
            f"Campaign {out.short(found.campaign)}: {runs}"
            f"{'' if found.is_everything else what}, without faults"
        )
    if not found.comparisons:
        out.emit("No conflict: there is nothing to drive.")
        return
    headers = ("Scenario", "Architecture", "Model", *_WORDS.values())
    rows = [
        [row.scenario, row.architecture, row.model, *(row.counts[cell] for cell in _WORDS)]
        for row in found.rows
    ]
    out.emit("")
    out.emit_table(headers, rows, right=headers[3:])
    _print_findings(found)
    out.emit("\nA benchmark, not a proof: what no model avoids may still be avoidable.")


def _print_findings(found: Preventability) -> None:
    findings = [item for item in found.comparisons if item.cell == "only_model"]
    if not findings:
        out.emit("\nNo finding: no model avoids a contact that an architecture does not.")
        return
    out.emit(f"\n{amount(len(findings), 'finding')}, avoided by the model only:")

    def impact(item: Comparison) -> str:
        return "" if item.impact_speed_mps is None else f"{item.impact_speed_mps:.2f}"

    out.emit_records(
        findings[:SHOWN],
        {
            "Run": lambda item: out.short(item.run),
            "Scenario": "scenario",
            "Architecture": "architecture",
            "Fault entry": "fault_entry",
            "Model": "model",
            "Impact [m/s]": impact,
            "Drive": lambda item: out.short(item.drive),
        },
        right=("Impact [m/s]",),
    )
    if len(findings) > SHOWN:
        out.emit(f"and {len(findings) - SHOWN} more; --json lists all.")
    first = findings[0]
    out.emit(
        f"See {out.clean(first.model)} beside {out.clean(first.architecture)}:\n"
        f"  adeye replay {out.short(first.run)} --html run.html\n"
        f"  adeye replay {out.short(first.drive)} --html drive.html"
    )
