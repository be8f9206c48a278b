"""Between what judging finds in traces and what the database keeps of it to judge again."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.evaluation.extremes import EXTREME, SAMPLES, Extremes
from adeye.evaluation.metrics import METRICS
from adeye.evaluation.requirements import JUDGE_VERSION
from adeye.kernel.clock import tick_times
from adeye.store.basis_block import BasisBlock, ExtremeBlock
from adeye.store.columns import Dictionary, Texts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from adeye.evaluation.judge import Evaluation


def basis_block(evaluation: Evaluation, files: Sequence[tuple[str, int] | None] = ()) -> BasisBlock:
    """Describe what judging the runs of a batch again depends on.

    Args:
        evaluation: Of the batch.
        files: Where its traces are kept; empty for nowhere.
    """
    frame = evaluation.frame
    parts = list(evaluation.extremes.items())
    counts = [len(item.run) for _, item in parts]
    run, row, value, actor = (
        np.concatenate([getattr(item, name) for _, item in parts])
        if parts
        else np.zeros((0, SAMPLES)[: 1 if name == "run" else 2], dtype=np.int64)
        for name in ("run", "row", "value", "actor")
    )
    names = Dictionary((*frame.objects, None))
    return BasisBlock(
        version=JUDGE_VERSION,
        uids={name: METRICS[name].uid for name in evaluation.metrics},
        by_contact=frame.by_contact,
        invalid=Texts.of(frame.invalid),
        extremes=ExtremeBlock(
            run=run,
            measure=Texts(
                np.repeat(np.arange(len(parts)), counts), Dictionary([name for name, _ in parts])
            ),
            value=value[:, EXTREME].astype(np.float64),
            time_s=np.where(
                row[:, EXTREME] >= 0, tick_times(row[:, EXTREME], frame.step_s), np.nan
            ),
            actor=Texts(actor[:, EXTREME], names),
            samples=Texts.of(
                [text for _, item in parts for text in _samples_texts(item, frame.objects)]
            ),
        ),
        files=tuple(files),
    )


def _samples_texts(found: Extremes, objects: Sequence[str]) -> list[str]:
    """Write the samples of each run as JSON: row, status, value and actor of each, and the end."""
    texts: list[str] = []
    columns = (found.row, found.status, found.value, found.actor)
    for rows, statuses, values, actors, is_cut in zip(
        *(column.tolist() for column in columns), found.is_cut.tolist(), strict=True
    ):
        samples = [
            None
            if row < 0
            else [
                row,
                status,
                None if math.isnan(value) else value,
                objects[actor] if actor >= 0 else None,
            ]
            for row, status, value, actor in zip(rows, statuses, values, actors, strict=True)
        ]
        texts.append(json.dumps([samples, is_cut], ensure_ascii=False, separators=(",", ":")))
    return texts


def extremes_of(stored: Sequence[Any], objects: dict[str, int]) -> Extremes:
    """Read the samples of runs.

    Args:
        stored: Of each run, as parsed JSON.
        objects: Numbers of objects by name; unknown names are added.
    """
    row = np.full((len(stored), SAMPLES), -1, dtype=np.int64)
    status = np.zeros((len(stored), SAMPLES), dtype=np.int64)
    value = np.full((len(stored), SAMPLES), np.nan)
    actor = np.full((len(stored), SAMPLES), -1, dtype=np.int64)
    for run, (samples, _) in enumerate(stored):
        for place, sample in enumerate(samples):
            if sample is None:
                continue
            row[run, place], status[run, place] = sample[0], sample[1]
            if sample[2] is not None:
                value[run, place] = sample[2]
            if sample[3] is not None:
                actor[run, place] = objects.setdefault(sample[3], len(objects))
    return Extremes(
        run=np.arange(len(stored)),
        row=row,
        value=value,
        status=status,
        actor=actor,
        is_cut=np.array([item[1] for item in stored], dtype=np.bool_),
    )
