"""Recorded runs made by hand, altered as runs that are handed to others may be."""

from dataclasses import replace
from typing import Any

import numpy as np

from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.trace import Trace


def in_left_hand_traffic(trace: Trace) -> Trace:
    """Return the same record, of a run whose mirror image it is."""
    road = replace(trace.layout.context.road, left_hand=True)
    return _in(trace, road=road)


def with_camera(trace: Trace, **changed: Any) -> Trace:
    """Return a trace whose camera is another sensor, or stands elsewhere."""
    content = trace.layout.architecture.model_dump(mode="json")
    content["sensors"]["camera"] |= changed
    if "kind" in changed:
        content["sensors"]["camera"] = changed
    architecture = Architecture.model_validate(content, context=SI)
    layout = replace(trace.layout, architecture=architecture, architectures=(architecture,))
    return replace(trace, layout=layout)


def with_kinds(trace: Trace, *classes: int, actors: int) -> Trace:
    """Return a trace whose objects are of these classes, and of which so many are actors."""
    return _in(trace, object_classes=np.array(classes), actor_count=actors)


def _in(trace: Trace, **changed: Any) -> Trace:
    context = replace(trace.layout.context, **changed)
    return replace(trace, layout=replace(trace.layout, context=context))
