"""What does the database cost per run, and how long do its views take with a million runs?

Made-up results of 25 metrics and six verdicts enter through the repository, without a simulation:
a plan, then blocks of 1,024 that are claimed and completed, in databases of 10⁴ and 10⁵ runs. CPU
time and bytes per run, how much dearer the last tenth of the blocks is than the first, and the
ratio of a size to the smallest; then wall time of the documented views as ``adeye query`` reads
them (median of the rounds after one that is thrown away), of ``adeye db verify``, and the peak of
memory.

    python benchmarks/store.py             the whole measurement
    python benchmarks/store.py --million   also with a million runs, needs 10 GB of disk
    python benchmarks/store.py --db URL    in a database of its own on a server, one --size
    python benchmarks/store.py --smoke     one short round, to see that it works
"""

from __future__ import annotations

import argparse
import multiprocessing
import resource
import statistics
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from support.made_up import ARCHITECTURES, PART, STRUCTURES, planned, record, results
from support.results import machine, table, write_result

from adeye.errors import InputError
from adeye.store.read.query import run_query
from adeye.store.repository import Repository

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

SIZES = (10_000, 100_000)
MILLION = 1_000_000
FEW = STRUCTURES * 5
SECONDS = 600.0
QUERIES = {
    "v_fsr_status": "SELECT * FROM v_fsr_status WHERE campaign = '{campaign}'",
    "v_gate": "SELECT * FROM v_gate WHERE campaign = '{campaign}'",
    "v_coverage": "SELECT * FROM v_coverage WHERE campaign = '{campaign}'",
    "v_runs, 1,000": "SELECT * FROM v_runs WHERE campaign = '{campaign}' LIMIT 1000",
    "v_runs, one": "SELECT * FROM v_runs WHERE campaign = '{campaign}' AND ordinal = {last}",
    "v_runs, contacts": "SELECT ordinal, parameters, contact_actor FROM v_runs "
    "WHERE campaign = '{campaign}' AND contact = 1",
    "v_runs_cut_in, 1,000": "SELECT * FROM v_runs_cut_in WHERE campaign = '{campaign}' LIMIT 1000",
    "v_runs_cut_in, contacts": "SELECT ordinal, ego_speed_mps, gap_m FROM v_runs_cut_in "
    "WHERE campaign = '{campaign}' AND contact = 1",
    "v_architecture_pairs, 1,000": "SELECT * FROM v_architecture_pairs "
    "WHERE campaign = '{campaign}' LIMIT 1000",
    "v_architecture_pairs, all": "SELECT scenario, COUNT(*), "
    "AVG(min_distance_m_difference) FROM v_architecture_pairs WHERE campaign = '{campaign}' "
    "GROUP BY scenario ORDER BY scenario",
    "v_architecture_pairs, by fault": "SELECT scenario, fault_entry, COUNT(*), "
    "AVG(min_distance_m_difference) FROM v_architecture_pairs WHERE campaign = '{campaign}' "
    "GROUP BY scenario, fault_entry ORDER BY scenario, fault_entry",
}


def fill(db: str, runs: int) -> tuple[str, dict[str, float]]:
    """Plan a campaign and complete it; return its id and what it took."""
    with Repository.open(db) as repository:
        _complete(repository, STRUCTURES)
        before = repository.info().size_bytes
        began = time.process_time()
        plan = repository.plan_campaign(record(), planned(runs), block_size=PART)
        took = {"plan_us": 1e6 * (time.process_time() - began) / runs}
        between = repository.info().size_bytes
        blocks: list[tuple[float, float, int]] = []
        while True:
            began, wall = time.process_time(), time.perf_counter()
            block = repository.claim_block(campaign=plan.campaign)
            if block is None:
                break
            claimed, waited = time.process_time() - began, time.perf_counter() - wall
            made = results(block)
            began, wall = time.process_time(), time.perf_counter()
            if not repository.complete_block(block, made):
                msg = f"block {block.id} was taken over"
                raise RuntimeError(msg)
            spent = claimed + time.process_time() - began
            blocks.append((spent, waited + time.perf_counter() - wall, len(made)))
        _require_all(repository, plan.campaign, runs)
        after = repository.info().size_bytes
    tenth = max(1, len(blocks) // 10)
    took |= {
        "complete_us": 1e6 * sum(item[0] for item in blocks) / runs,
        "complete_wall_us": 1e6 * sum(item[1] for item in blocks) / runs,
        "last_to_first": _per_run(blocks[-tenth:]) / _per_run(blocks[:tenth]),
        "plan_bytes": (between - before) / runs,
        "run_bytes": (after - between) / runs,
    }
    return plan.campaign, took


def _complete(repository: Repository, runs: int) -> None:
    """Have a small campaign first: what is compiled and cached is no part of the costs."""
    plan = repository.plan_campaign(record(), planned(runs, "first"), block_size=PART)
    while (block := repository.claim_block(campaign=plan.campaign)) is not None:
        repository.complete_block(block, results(block))


def _per_run(blocks: Sequence[tuple[float, float, int]]) -> float:
    return sum(item[0] for item in blocks) / sum(item[2] for item in blocks)


def _require_all(repository: Repository, campaign: str, runs: int) -> None:
    found = repository.progress(campaign)
    if (found.executed, found.accounted) != (runs, runs):
        msg = f"{found.executed} of {runs} runs are there, {found.accounted} accounted for"
        raise RuntimeError(msg)


def ask(db: str, campaign: str, runs: int, rounds: int) -> dict[str, float]:
    """Measure every query [s]."""
    names = {"campaign": campaign, "last": runs - 1}
    took: dict[str, float] = {}
    for name, sql in QUERIES.items():
        found: list[float] = []
        for number in range(rounds + 1):
            began = time.perf_counter()
            told = run_query(db, sql.format(**names), timeout_s=SECONDS)
            if number:
                found.append(time.perf_counter() - began)
        _require_told(name, told.rows, runs)
        took[name] = statistics.median(found)
    return took


def _require_told(name: str, rows: Sequence[tuple[Any, ...]], runs: int) -> None:
    """See that a view that counts everything did."""
    column, wanted = {
        "v_coverage": (4, runs),
        "v_architecture_pairs, all": (1, runs // len(ARCHITECTURES)),
        "v_architecture_pairs, by fault": (2, runs // len(ARCHITECTURES)),
    }.get(name, (None, 0))
    counted = 0 if column is None else sum(row[column] for row in rows)
    if counted != wanted:
        msg = f"{name} counts {counted} instead of {wanted}"
        raise RuntimeError(msg)


def verify(db: str) -> float:
    """Measure ``adeye db verify`` [s]."""
    with Repository.open(db, create=False) as repository:
        began = time.perf_counter()
        findings = repository.verify()
        took = time.perf_counter() - began
    if findings:
        msg = f"a database that nobody altered: {findings[:3]}"
        raise RuntimeError(msg)
    return took


def measure(db: str, runs: int, rounds: int) -> dict[str, Any]:
    """Fill a database and ask it, each in a process of its own for the peak of its memory."""
    print(f"{runs:,} runs: filling", file=sys.stderr)
    (campaign, took), fill_mib = _alone(fill, db, runs)
    print(f"{runs:,} runs: asking", file=sys.stderr)
    asked, ask_mib = _alone(ask, db, campaign, runs, rounds)
    print(f"{runs:,} runs: verifying", file=sys.stderr)
    verified, verify_mib = _alone(verify, db)
    memory = {"fill_mib": fill_mib, "ask_mib": ask_mib, "verify_mib": verify_mib}
    return {"runs": runs, **took, "queries_s": asked, "verify_s": verified, **memory}


def _alone(work: Callable[..., Any], *given: Any) -> tuple[Any, float]:
    """Call something in a new process; return what it returns and its peak of memory [MiB]."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(_with_peak, (work, given))  # type: ignore[no-any-return]


def _with_peak(work: Callable[..., Any], given: tuple[Any, ...]) -> tuple[Any, float]:
    told = work(*given)
    return told, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def cells(item: dict[str, Any], least: dict[str, Any]) -> list[str]:
    """Write what filling took."""
    total, base = (one["plan_us"] + one["complete_us"] for one in (item, least))
    return [
        f"{item['runs']:,}",
        *[f"{item[name]:.1f}" for name in ("plan_us", "complete_us", "complete_wall_us")],
        *[f"{item[name]:,.0f}" for name in ("plan_bytes", "run_bytes")],
        f"{item['last_to_first']:.2f}",
        f"{total / base:.2f}",
        f"{item['verify_s']:.1f}",
        *[f"{item[name]:,.0f}" for name in ("fill_mib", "ask_mib", "verify_mib")],
    ]


def report(found: Sequence[dict[str, Any]]) -> str:
    """Write both tables."""
    headers = ["runs", "plan [µs/run]", "complete [µs/run]", "wall [µs/run]", "plan [B/run]"]
    headers += ["results [B/run]", "last to first tenth", "ratio", "verify [s]"]
    headers += ["peak filling [MiB]", "asking", "verifying"]
    filled = table(headers, [cells(item, found[0]) for item in found])
    rows = [
        [name, *[f"{item['queries_s'][name]:.3f}" for item in found]]
        for name in found[0]["queries_s"]
    ]
    sizes = [f"{item['runs']:,} runs" for item in found]
    return f"{filled}\n\n{table(['query [s]', *sizes], rows)}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure, print the tables and write the result."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--smoke", action="store_true", help="one short round")
    parser.add_argument("--million", action="store_true", help="also a million runs")
    parser.add_argument("--rounds", type=int, default=3, help="rounds of queries, at least 3")
    parser.add_argument("--size", type=int, help=f"only this many runs, a multiple of {STRUCTURES}")
    parser.add_argument("--db", help="an empty database, by path or URL; it is kept")
    given = parser.parse_args(arguments)
    if not given.smoke and given.rounds < 3:
        parser.error("the median of fewer than 3 rounds says nothing")
    if given.size is not None and (given.size < STRUCTURES or given.size % STRUCTURES):
        parser.error(f"--size {given.size} is no multiple of {STRUCTURES}")
    if given.db and given.size is None and not given.smoke:
        parser.error("one database holds one size: name it with --size")
    sizes = (*SIZES, MILLION) if given.million else SIZES
    if given.size or given.smoke:
        sizes = (given.size or FEW,)
    rounds = 1 if given.smoke else given.rounds
    if given.db:
        Repository.open(given.db).close()
        try:
            # Who may not ask on a server hears it before a million runs are there.
            run_query(given.db, "SELECT COUNT(*) FROM campaign")
        except InputError as error:
            parser.error(str(error))
    found = []
    for runs in sizes:
        with tempfile.TemporaryDirectory() as folder:
            found.append(measure(given.db or str(Path(folder) / "adeye.db"), runs, rounds))
    print(report(found))
    if not given.smoke:
        where = given.db.partition(":")[0] if given.db and "://" in given.db else "sqlite"
        made = {"machine": machine(), "database": where, "sizes": found}
        print(f"wrote {write_result('store', made)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
