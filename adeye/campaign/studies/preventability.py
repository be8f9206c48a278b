"""Drive the situations of stored runs with reference drivers: was it preventable at all?"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from adeye.campaign.executors import InProcess, Threads
from adeye.campaign.plan import Contents
from adeye.campaign.replay import (
    MOST_TOGETHER,
    Counter,
    Recalled,
    Report,
    recalled_parts,
    require_same_code,
)
from adeye.campaign.work import describe, evaluate, grouped
from adeye.errors import InputError, IntegrityError, UsageError, require_known
from adeye.judge.preventability import CellCount, Comparison, is_conflict, tabulate_cells
from adeye.kernel.reference_drivers.reactions import EDITIONS, MODELS, parameters_of
from adeye.signals import NO_FAULT
from adeye.simulate.engine import identity
from adeye.simulate.engine import run as run_batch
from adeye.spec.architecture import Architecture
from adeye.spec.channels import ReferenceName, reference_content
from adeye.spec.quantity import SI
from adeye.store.records import EngineKey
from adeye.store.repository import Repository
from adeye.store.write.studies import Benchmarks, DriveRecord
from adeye.sweep.case import TestCase, structure_key
from adeye.units import Dimension, parse_quantity

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.store.block import RunBlock

EDITION: Final = "r157-01"
"""Edition of a gate."""


@dataclass(frozen=True)
class Preventability:
    """Runs of a campaign beside the drives of reference drivers.

    Attributes:
        campaign: Id.
        executed: Runs with a result.
        looked_at: Runs with a conflict that were held against a model, by model.
        threshold_mps2: Required deceleration that counts as a conflict [m/s²], by model.
        is_everything: Whether every run was taken for one with a conflict.
        rows: Cells by scenario, architecture and model.
        comparisons: The runs.
    """

    campaign: str
    executed: int
    looked_at: dict[str, int]
    threshold_mps2: dict[str, float]
    is_everything: bool
    rows: tuple[CellCount, ...]
    comparisons: tuple[Comparison, ...]


@dataclass(frozen=True)
class _Wanted:
    """A drive to execute, and the runs that it is held against."""

    case: TestCase
    origin_case: str
    engine: EngineKey
    variant: str | None
    folders: Mapping[str, Path]
    drives: list[DriveRecord]


_SOUND: Final = {
    "max_acceleration": 3.0,
    "max_deceleration": 9.0,
    "max_steering_angle": parse_quantity("35 deg", Dimension.ANGLE),
    "max_steering_rate": parse_quantity("30 deg/s", Dimension.ANGULAR_RATE),
}
"""What a sound car can do at least, in SI; our choice, as in ``reference_cc.yaml``."""
_STEERING_LAG: Final = 0.1
"""At most [s]."""


def reference_architecture(
    vehicle: dict[str, Any], model: str, edition: str, step: float
) -> Architecture:
    """Make the architecture that a reference driver is: ground truth and one channel.

    Only the body is that of the vehicle. Brakes and steering are as good as those of a sound car at
    least: what the vehicle cannot do excuses nothing. The models' delays and ramps are those of
    driver and brakes together, so that the brakes answer at once.

    Args:
        vehicle: Content of the vehicle that it drives, in SI.
        model: One of ``kernel.reference_drivers.drivers.MODELS``.
        edition: Of its rules.
        step: Master clock [s]; the driver looks at every tick.
    """
    name = ReferenceName(model, edition)
    able = {key: max(vehicle[key], least) for key, least in _SOUND.items()}
    able["steering_lag"] = min(vehicle["steering_lag"], _STEERING_LAG)
    content = reference_content(name, {**vehicle, **able, "plant": None}, 1.0 / step, 0.0)
    # The same driver, whatever its edition: what tells them apart is the parameter.
    content["architecture"] = f"reference_{model}"
    return Architecture.model_validate(content, context=SI)


def check_models(models: Sequence[str], edition: str) -> None:
    """Refuse names of models and editions that there are not.

    Raises:
        UsageError: One is unknown, or no model is named.
    """
    if not models:
        raise UsageError("--model: names no model", remedy=f"There are: {', '.join(MODELS)}.")
    require_known(models, MODELS, lambda name: f"--model: there is no reference driver {name!r}")
    require_known([edition], EDITIONS, lambda name: f"--edition: there is no edition {name!r}")


def prevent(  # noqa: PLR0913 - what is asked, and how
    db: str | Path | None,
    name: str | None = None,
    *,
    models: Sequence[str] = ("cc",),
    edition: str = EDITION,
    threshold: float | None = None,
    everything: bool = False,
    workers: int = 1,
    report: Report | None = None,
) -> Preventability:
    """Drive situations with a conflict by reference drivers, and say who avoids a contact.

    Drives are kept as results of their own, in no campaign, and not executed again.

    Args:
        db: Database, by default ``.adeye/adeye.db``.
        name: A campaign (id, its beginning or number) or the beginning of a run's result digest;
            None for the newest campaign.
        models: Reference drivers.
        edition: Of their rules.
        threshold: Required deceleration from which on a run without a contact has a conflict
            [m/s²]; None for the full braking of each model.
        everything: Take every run for one with a conflict, so that contacts of the model alone are
            found as well.
        workers: Batches that are executed at once.
        report: Called with how many drives are executed.

    Raises:
        InputError: There is no such run or campaign.
        IntegrityError: A result contradicts one that exists.
        UsageError: There is no such model or edition.
    """
    check_models(models, edition)
    limits = {
        model: parameters_of(model, edition).braking if threshold is None else threshold
        for model in models
    }
    with Repository.open(db, create=False) as repository:
        campaign, only = _named(repository, name)
        repository.require_sound(campaign)
        benchmarks = repository.hindsight.benchmarks
        candidates = [
            item
            for item in benchmarks.candidates(campaign)
            if only is None or item.run.result_digest == only
        ]
        is_everything = everything or only is not None
        asked = {
            (item.run.result_digest, model)
            for item in candidates
            for model, limit in limits.items()
            if is_everything or is_conflict(item.contact, item.required_mps2, limit)
        }
        missing = asked - {(item.run, item.model) for item in benchmarks.of(campaign, edition)}
        runs = {run for run, _ in missing}
        counter = Counter("drives", len(missing), report)
        chosen = [item.run for item in candidates if item.run.result_digest in runs]
        for part in recalled_parts(repository, chosen):
            wanted = [
                (recalled, model)
                for recalled in part
                for model in limits
                if (recalled.run.result_digest, model) in missing
            ]
            _drive(benchmarks, wanted, edition, workers, counter)
        found = [
            item for item in benchmarks.of(campaign, edition) if (item.run, item.model) in asked
        ]
    if len(found) != len(asked):
        raise IntegrityError(f"{len(asked) - len(found)} drives are not in the database")
    found.sort(key=lambda item: (item.scenario, item.architecture, item.model, item.run))
    return Preventability(
        campaign=campaign,
        executed=len(candidates),
        looked_at={model: sum(name == model for _, name in asked) for model in limits},
        threshold_mps2=limits,
        is_everything=is_everything,
        rows=tabulate_cells(found),
        comparisons=tuple(found),
    )


def _named(repository: Repository, name: str | None) -> tuple[str, str | None]:
    """Return the campaign and, if a run is named, that run."""
    try:
        return repository.find_campaign(name).id, None
    except InputError as error:
        if name is None:
            raise
        try:
            run = repository.find_run(name)
        except InputError:
            raise error from None
    if run.is_drive:
        raise InputError(
            f"run {name!r} is a drive of a reference driver itself",
            remedy="Name the run that it is held against.",
        )
    return run.campaign, run.result_digest


def _drive(
    benchmarks: Benchmarks,
    drives: Sequence[tuple[Recalled, str]],
    edition: str,
    workers: int,
    counter: Counter,
) -> None:
    """Execute drives of runs by models, unless there are results of them already."""
    contents = Contents()
    drivers: dict[tuple[str, str, float], Architecture] = {}
    wanted: dict[str, _Wanted] = {}
    unchanged = require_same_code(recalled for recalled, _ in drives if recalled.case.fmus)
    for recalled, model in drives:
        case, work = recalled.case, recalled.work
        vehicle = case.architecture.vehicle
        key = (model, vehicle.model_dump_json(), case.step)
        if key not in drivers:
            content = vehicle.model_dump(mode="json")
            drivers[key] = reference_architecture(content, model, edition, case.step)
        driven = replace(
            case, architecture=drivers[key], faults=(), fault_entry=NO_FAULT, override=None
        )
        now = identity(work.backend, work.variant)
        engine = EngineKey(work.backend, now.variant, now.numerics_version, "")
        digest = engine.result_digest(driven.digest)
        drive = DriveRecord(recalled.run.result_digest, model, edition, digest)
        if digest not in wanted:
            origin = recalled.run.test_case
            # The FMUs stay that drive others.
            own = recalled.case.architecture.architecture
            folders = {**work.folders, driven.architecture.architecture: work.folders[own]}
            wanted[digest] = _Wanted(driven, origin, engine, work.variant, folders, [])
        wanted[digest].drives.append(drive)
    there: list[_Wanted] = []
    missing: list[_Wanted] = []
    for digest, item in wanted.items():
        (there if benchmarks.result_of(digest) else missing).append(item)
    _save(benchmarks, contents, there, None, counter)
    executor = InProcess(_execute) if workers == 1 else Threads(_execute, workers)
    try:
        batches = grouped(
            missing,
            lambda item: (
                structure_key(item.case),
                item.engine,
                item.variant,
                tuple(item.folders.values()),
            ),
            MOST_TOGETHER,
        )
        for done in executor.run(batches):
            if done.result is None:
                raise IntegrityError(done.lost)
            unchanged.check()
            # Batch by batch: whoever interrupts and asks again goes on from there.
            _save(benchmarks, contents, done.task, done.result, counter)
    finally:
        executor.close()


def _execute(batch: list[_Wanted]) -> RunBlock:
    cases = [item.case for item in batch]
    first = batch[0]
    trace = run_batch(
        cases, backend=first.engine.backend, variant=first.variant, base_dirs=first.folders
    )
    # No FSR: it is written for the architectures of its campaign.
    evaluation = evaluate(trace, cases, (), ())
    return describe(trace, evaluation, [item.engine for item in batch])


def _save(
    benchmarks: Benchmarks,
    contents: Contents,
    drives: Sequence[_Wanted],
    block: RunBlock | None,
    counter: Counter,
) -> None:
    if not drives:
        return
    records = [contents.architecture(item.case.architecture) for item in drives]
    benchmarks.save(
        list({record.digest: record for record in records}.values()),
        [
            (item.case.digest, item.origin_case, record.digest, item.case.situation_digest)
            for item, record in zip(drives, records, strict=True)
        ],
        block,
        [record for item in drives for record in item.drives],
    )
    counter.add(sum(len(item.drives) for item in drives))
