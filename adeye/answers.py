"""Answers about a campaign that the database gives: where an FSR fails, what changed, the gate.

Nothing is executed or drawn, so that whoever asks waits for neither. ``reporting`` draws.
"""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.naming import campaign_called, campaign_of_file, find_called, is_file_name
from adeye.fields import fields_of
from adeye.kernel.relation import tick_time
from adeye.notices import notice
from adeye.outputs import write_atomically
from adeye.store.location import option

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from adeye.report.claims import ClaimOptions, Claims
    from adeye.report.comparison.records import CompareOptions, Comparison
    from adeye.report.gate.decide import GateOptions, GateResult
    from adeye.report.gate.difference import Difference
    from adeye.report.where.records import Where
    from adeye.store.records import CampaignInfo, StoredCase
    from adeye.store.repository import Repository


def compare_campaign(
    db: str | Path | None,
    names: Sequence[str],
    options: CompareOptions,
    *,
    html: Path | None = None,
) -> Comparison:
    """Compare architectures of a campaign and write the page if it is asked for.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        names: A campaign (an ODD's file or id, a number or the beginning of a digest), unless the
            first is an architecture of the newest one; then the architectures.
        options: How they are compared; its architectures are those of ``names``.
        html: Page to write.

    Raises:
        InputError: There is no such campaign or architecture.
        IntegrityError: Results are not as they were written.
        PlatformError: The file cannot be written.
    """
    from adeye.report.comparison.compare import compare
    from adeye.report.files import guarding
    from adeye.store.repository import Repository

    with guarding(db, {"html": html}):
        with Repository.open(db, create=False) as repository:
            campaign, architectures = _campaign_among(repository, names)
            repository.require_sound(campaign.id)
            options = replace(options, architectures=architectures)
            comparison = compare(repository, campaign, options)
        if html is not None:
            from adeye.report.page.html import render_comparison

            write_atomically(render_comparison(comparison).encode(), html)
    return comparison


def where_in(
    db: str | Path | None,
    name: str | None,
    fsr: str,
    *,
    by: Sequence[str] = (),
    architectures: Collection[str] = (),
) -> Where:
    """Tell where among the swept values of a campaign an FSR fails.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        name: An ODD's file or id, or a campaign by number or digest; default: the newest.
        fsr: Id of the FSR.
        by: At most two axes to count by.
        architectures: Those to look at; none: all.

    Raises:
        InputError: There is no such campaign, FSR, architecture or axis.
        IntegrityError: Results are not as they were written.
    """
    from adeye.report.where.tell import tell_where
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        campaign = find_called(repository, name)
        repository.require_sound(campaign.id, has_figures=False, has_accounts=False)
        return tell_where(repository, campaign, fsr, by=by, architectures=architectures)


def diff_campaigns(db: str | Path | None, old: str | None, new: str | None) -> Difference:
    """Tell what changed from one campaign to another; nothing is executed.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        old: An ODD's id, a campaign by number or digest, ``latest``, or ``@{-n}``, which is the
            n-th one before the latest of its ODD; default: the one before ``new`` of its ODD.
        new: The same; default: the newest.

    Raises:
        InputError: There is no such campaign.
        IntegrityError: Results are not as they were written.
    """
    from adeye.report.gate.difference import find_difference
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        after = find_called(repository, new)
        before = repository.campaign_before(after) if old is None else find_called(repository, old)
        for name in dict.fromkeys((before.id, after.id)):
            repository.require_sound(name)
        return find_difference(repository, before, after)


def claim(db: str | Path | None, name: str | None, options: ClaimOptions) -> Claims:
    """Say what a campaign allows to say about the probability of a violation.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        name: An ODD's file or id, or a campaign by number or digest; default: the newest.
        options: Level, method, target.

    Raises:
        InputError: There is no such campaign, or an option is out of range.
        IntegrityError: Results are not as they were written.
    """
    from adeye.report.claims import claims_of
    from adeye.store.read.totals import refused_in_words
    from adeye.store.repository import Repository

    with Repository.open(db, create=False) as repository:
        campaign = find_called(repository, name)
        repository.require_sound(campaign.id)
        for text in refused_in_words(repository, campaign):
            notice(text)
        return claims_of(repository, campaign, options)


def _campaign_among(
    repository: Repository, names: Sequence[str]
) -> tuple[CampaignInfo, Sequence[str]]:
    """Tell the campaign from the architectures that follow it."""
    if not names:
        return repository.find_campaign(), ()
    found = campaign_called(repository, names[0])
    if found is None:
        return repository.find_campaign(), names
    return found, names[1:]


def gate_campaign(db: str | Path | None, name: str | None, options: GateOptions) -> GateResult:
    """Judge a campaign by its verdicts and against a baseline; nothing is executed.

    Every stored row is verified first: what was altered makes no verdict.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        name: Campaign by its ODD's file or id, its number or digest; None for the newest.
        options: What is asked.

    Raises:
        InputError: There is no such campaign, or no such baseline.
        IntegrityError: The baseline was edited.
        PlatformError: A file cannot be written.
    """
    from adeye.report.files import guarding
    from adeye.report.gate.decide import judge_campaign, update_baseline
    from adeye.store.repository import Repository

    updated = options.baseline if options.is_update else None
    files = {"junit": options.junit, "--baseline": updated}
    with guarding(db, files, also_read="--baseline"):
        with Repository.open(db, create=False) as repository:
            campaign, edits = _gated(repository, name)
            result = judge_campaign(
                repository,
                campaign,
                options.baseline,
                options.tolerances,
                may_lack=options.is_update,
                edits=edits,
            )
            if options.junit is not None:
                from adeye.reporting import junit_of

                write_atomically(junit_of(repository, campaign, db, result), options.junit)
        if options.is_update and options.baseline is not None:
            return update_baseline(
                result, options.baseline, accepts_incomplete=options.accepts_incomplete
            )
    return result


def _gated(repository: Repository, name: str | None) -> tuple[CampaignInfo, str]:
    """Find the campaign to judge and, of an ODD's file, what makes it another one by now."""
    if name is None or not is_file_name(name):
        return find_called(repository, name), ""
    meant = campaign_of_file(repository, name)
    if not meant.edits:
        return meant.campaign, ""
    text = (
        f"{name} plans something else than campaign {meant.campaign.number}; edited: "
        f"{meant.edits}. Run adeye run {name}, what is there already is not executed again"
    )
    return meant.campaign, text


# --- What is stored of one run -------------------------------------------------------------------


def _fork_fields(case: StoredCase) -> dict[str, Any]:
    """Say what a run is a fork of."""
    if case.fork is None:
        return {}
    return {
        "fork_of": case.fork.origin,
        "authority": case.fork.authority,
        "from_tick": case.fork.from_tick,
        "from_time_s": tick_time(case.fork.from_tick, case.step_s),
    }


_OF_ROW: Final = (
    *("outcome", "outcome_channel", "outcome_detail", "end_reason", "duration_s"),
    *("trace_digest", "backend", "variant"),
)
"""What a description has of the row of a run, by the same name."""
_OF_VERDICT: Final = (
    *("margin", "unit", "signal", "predicate", "time_s", "actor", "value", "threshold", "detail"),
)
"""The same of a verdict."""


def describe_run(db: str | Path | None, run: str) -> dict[str, Any]:
    """Say everything that the database holds about a run, JSON-compatible.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        run: Beginning of its result digest.
    """
    from adeye.store.read.reader import Reader
    from adeye.sweep.values import named_values

    with Reader.open(db) as reader:
        ref = reader.find_run(run)
        stored = reader.run_row(ref.result_digest)
        case = reader.test_case_row(ref.test_case)
        campaign = reader.find_campaign(ref.campaign)
        odd = reader.content("odd", campaign.odd_digest)
        wanted = {} if stored is None else reader.judged_digests(ref, stored)
        measures = reader.measures(campaign.concept_digest)
        contested = reader.contested(ref.campaign).get(ref.result_digest)
    parameters = named_values(dict(case.parameters), odd, ref.scenario)
    paths = {name: value for name, value in ref.point.items() if name not in case.parameters}
    described: dict[str, Any] = {
        "run": ref.result_digest,
        "test_case": ref.test_case,
        "situation": case.situation,
        **fields_of(ref, "campaign", "ordinal", "scenario", "architecture"),
        **fields_of(case, "fault_entry", "replicate", "seed", "step_s"),
        "parameters": {item.label: item.value for item in parameters},
        "swept_paths": {item.label: item.value for item in named_values(paths, odd, ref.scenario)},
        **_fork_fields(case),
        "is_done": stored is not None,
        "command": f"adeye replay {ref.result_digest[:12]}{option(db)}",
    }
    if stored is None:
        return described
    row = stored.row
    return described | {
        **{name: row[name] for name in _OF_ROW},
        "machine_dependent": bool(row["machine_dependent"]),
        **({"not_certified": contested} if contested else {}),
        "metrics": {name: asdict(item) for name, item in stored.metrics.items()},
        "verdicts": [
            {
                "fsr": item.fsr_id,
                "verdict": item.verdict.value,
                "exercised": item.is_exercised,
                **fields_of(item, *_OF_VERDICT),
                "measure": measures[item.fsr_id],
            }
            for item in stored.verdicts
            if wanted.get(item.fsr_id) == item.fsr_digest
        ],
        "events": [asdict(item) for item in stored.events],
    }
