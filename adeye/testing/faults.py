"""Fakes for those who write faults: an injector on its own, and the tick that it is told."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from adeye.faults.catalogue import make_injector
from adeye.faults.ports import InjectorContext, Moment
from adeye.kernel.random import owner_id
from adeye.signals import EGO_COLUMNS
from adeye.spec.fault import FAULT
from adeye.testing.sensors import three_objects

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from adeye.signals import Bools, Floats, SceneContext
    from adeye.spec.architecture import Architecture


def injector(  # noqa: PLR0913 - all but two have a default
    model: str,
    target: str,
    *,
    runs: int = 3,
    context: SceneContext | None = None,
    step: float = 0.05,
    parameters: Sequence[Mapping[str, Any]] | None = None,
    architecture: Architecture | None = None,
) -> Any:
    """Make the injector of one fault.

    Args:
        model: Of the fault.
        target: What fails.
        runs: B.
        context: Objects, sizes and seeds of the batch; ``three_objects`` unless given.
        step: Master clock [s].
        parameters: What the model has beside, as in YAML, for each run.
        architecture: Has the target; models that look at it need one.
    """
    fixed = {"id": "tested", "target": target, "model": model, "onset": {"at": "0 s"}}
    specs = [FAULT.validate_python({**fixed, **dict(item)}) for item in parameters or [{}] * runs]
    owner = np.uint64(owner_id("fault/tested"))
    scene = context or three_objects()
    architectures = [] if architecture is None else [architecture] * len(specs)
    return make_injector(InjectorContext(specs, scene, step, owner, architectures))


def moment(
    active: Bools,
    *,
    time: float = 0.0,
    age: float | Floats = 0.0,
    ego: Floats | None = None,
) -> Moment:
    """Return a tick at which a fault is active in some runs.

    Args:
        active: (B,).
        time: [s].
        age: Time since its onset [s], one or (B,).
        ego: (B, 7) states; at rest in the origin unless given.
    """
    ages = np.broadcast_to(np.asarray(age, dtype=np.float64), active.shape).copy()
    states = np.zeros((len(active), len(EGO_COLUMNS))) if ego is None else ego
    return Moment(time, active, ages, states)
