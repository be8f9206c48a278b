"""A reference driver as an architecture: ground truth, one channel and the vehicle of another.

``reference:cc`` in an ODD stands for such an architecture, where others have the name of a file;
``reference:reg157@eu-2022-1426`` has an edition, ``reference:cc+jrc-coasting`` a variant.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal, NamedTuple, get_args

from adeye.errors import SourceLocation, SpecError, suggest
from adeye.spec.quantity import Many, Record
from adeye.spec.sensors import PositiveLength
from adeye.spec.supervisor import PositiveAcceleration

ReferenceVariant = Literal[
    "jrc",
    "jrc-guard",
    "jrc-lateral",
    "jrc-release",
    "jrc-raw-acceleration",
    "jrc-ttc-end",
    "jrc-coasting",
    "jrc-first-step",
    "jrc-perception",
    "jrc-no-emergency",
    "jrc-rss-lateral",
    "jrc-beside",
    "jrc-lead",
    "jrc-distance",
    "esmini",
    "esmini-gravity",
    "esmini-reaction",
    "esmini-perception",
]


class ReferenceParameters(Record):
    """Reference channel: which driver of UN R157 drives, and how it drives without a conflict."""

    model: Literal["cc", "fsm", "rss", "reg157"] = "cc"
    """Careful and competent driver, fuzzy safety model, responsibility-sensitive safety, or the
    cut-in rule of paragraph 5.2.5.2 made a driver."""
    edition: Literal["r157", "r157-01", "eu-2022-1426", "eu-2022-1426-standing"] = "r157-01"
    """Whose numbers hold; it changes ``reg157`` only."""
    variant: Many[ReferenceVariant] = ()
    """Differences of published code to the text, by name; ``jrc`` and ``esmini`` are all of one."""
    standstill_gap: PositiveLength = 2.0
    max_acceleration: PositiveAcceleration = 1.5
    comfort_deceleration: PositiveAcceleration = 2.5
    """Most that it slows down by to follow a vehicle that the model sees no conflict with."""


PREFIX: Final = "reference:"
MODELS: Final[tuple[str, ...]] = get_args(ReferenceParameters.model_fields["model"].annotation)
EDITIONS: Final[tuple[str, ...]] = get_args(ReferenceParameters.model_fields["edition"].annotation)
VARIANTS: Final[tuple[str, ...]] = get_args(ReferenceVariant)

_SENSOR, _CHANNEL = "truth", "driver"


class ReferenceName(NamedTuple):
    """What a name of a reference driver says.

    >>> ReferenceName("reg157", "eu-2022-1426", ("jrc-guard",)).architecture
    'reference_reg157_eu_2022_1426_jrc_guard'
    >>> ReferenceName("cc").architecture
    'reference_cc'
    """

    model: str
    edition: str = ReferenceParameters().edition
    variant: tuple[str, ...] = ()

    @property
    def architecture(self) -> str:
        """Id of the architecture; the usual edition is not part of it."""
        other = [self.edition] if self.edition != ReferenceParameters().edition else []
        return "_".join(["reference", self.model, *other, *self.variant]).replace("-", "_")


def read_name(text: str, where: SourceLocation) -> ReferenceName | None:
    """Read the name of a reference driver.

    Args:
        text: ``reference:MODEL``, with ``@EDITION`` and any number of ``+VARIANT`` if wanted.
        where: Its place.

    Returns:
        None for what does not begin with ``reference:``.

    Raises:
        SpecError: There is no such model, edition or variant, or a variant is named twice.
    """
    if not text.startswith(PREFIX):
        return None
    head, *variant = text.removeprefix(PREFIX).split("+")
    model, _, edition = head.partition("@")
    if "@" not in head:
        edition = ReferenceParameters().edition
    for what, name, known in (
        ("reference driver", model, MODELS),
        ("edition", edition, EDITIONS),
        *(("variant", name, VARIANTS) for name in variant),
    ):
        if name not in known:
            near = suggest(name, known)
            listed = f"Take one of {', '.join(known)}."
            remedy = f"{near} {listed}" if near.endswith("?") else listed
            raise SpecError(f"{text!r}: there is no {what} {name!r}", where=where, remedy=remedy)
    if len(set(variant)) < len(variant):
        raise SpecError(
            f"{text!r} names a variant twice", where=where, remedy="Name each variant once."
        )
    return ReferenceName(model, edition, tuple(variant))


def reference_content(
    name: ReferenceName, vehicle: Mapping[str, Any], rate: float | str, no_lag: float | str
) -> dict[str, Any]:
    """Make the content of the architecture that a reference driver is.

    The models' delays and ramps are those of driver and brakes together, so that the brakes answer
    at once: a lag of the vehicle would count twice.

    Args:
        name: Which driver.
        vehicle: Content of the vehicle that it drives.
        rate: Of sensor and driver, that of the master clock: it looks at every tick.
        no_lag: A duration of nothing, written as in ``vehicle``.
    """
    parameters: dict[str, Any] = {"model": name.model, "edition": name.edition}
    if name.variant:
        parameters["variant"] = list(name.variant)
    of = " with ".join([name.edition, *([", ".join(name.variant)] if name.variant else [])])
    return {
        "architecture": name.architecture,
        "title": f"Reference driver {name.model} of {of}",
        "vehicle": {**vehicle, "acceleration_lag": no_lag},
        "sensors": {_SENSOR: {"kind": "ground_truth", "rate": rate}},
        "channels": {
            _CHANNEL: {
                "kind": "reference",
                "links": [_SENSOR],
                "rate": rate,
                "parameters": parameters,
            }
        },
        "switch": {"policy": "fixed_priority", "priority": [_CHANNEL], "default": _CHANNEL},
    }
