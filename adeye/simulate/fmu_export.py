"""Parts of an architecture as FMUs of FMI 3.0 for co-simulation, written by pythonfmu3.

Such an FMU holds what its part is made from, and a few lines of Python that ask adeye: whoever
imports it needs a Python with adeye of the same version. It takes steps of its own length: what it
is told before a step from a tick counts at that tick, and its outputs after the step are what came
of it, see ``parts``.
"""

from __future__ import annotations

import hashlib
import json
import re
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from adeye.errors import IntegrityError, UsageError, needing
from adeye.fields import fields_of
from adeye.outputs import replacing
from adeye.simulate import parts
from adeye.spec.architecture import Architecture
from adeye.spec.quantity import SI
from adeye.spec.scenario import LogicalScenario
from adeye.sweep.case import content_digest, lone_case
from adeye.units import UNITS
from adeye.version import __version__

Kind = Literal["plant", "sensor", "channel", "arbiter"]

OF_SCENARIO: Final = ("sensor", "channel")
"""Kinds of which an architecture has several by name, and that know a scenario."""

_CONTENT: Final = "adeye_part.json"
"""What an FMU is made from; ``outputs`` knows our FMUs by this name at their beginning."""

_SLACK: Final = 1e-6
"""Share of a step by which times may be off: who imports adds them up."""

_MODULE: Final = '''\
"""A part of adeye {version}."""

from pythonfmu3 import Fmi3Slave

from adeye.simulate.fmu_export import Served


class {name}(Fmi3Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self._served = Served(self)

    def exit_initialization_mode(self):
        self._served.begin()

    def do_step(self, current_time, step_size):
        return self._served.step(current_time, step_size)
'''
"""What is asked by the importer; its class is found by a search for its base."""
_DATE: Final = re.compile(rb' generationDateAndTime="[^"]*"')
_EPOCH: Final = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Export:
    """What an FMU is made from.

    Attributes:
        kind: Of the part.
        architecture: It is a part of this one.
        step: From a tick to the next [s].
        name: Of the sensor or channel; of others, nothing.
        scenario: What a sensor or channel knows of the world.
        parameters: Values of the scenario's parameters in SI.
        seed: Of what sensors draw.
    """

    kind: Kind
    architecture: Architecture
    step: float
    name: str = ""
    scenario: LogicalScenario | None = None
    parameters: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0

    def part(self) -> parts.Part:
        """Make the part.

        Raises:
            UsageError: There is none of that name, or it cannot be exported.
        """
        if self.kind == "plant":
            return parts.vehicle_part(self.architecture, self.step)
        if self.kind == "arbiter":
            return parts.switch_part(self.architecture, self.step)
        assert self.scenario is not None
        case = lone_case(
            self.scenario, self.architecture, self.parameters, step=self.step, seed=self.seed
        )
        make = parts.sensor_part if self.kind == "sensor" else parts.channel_part
        return make(case, self.name)

    def text(self) -> str:
        """Write it down, with what tells whether it is read as it was written."""
        records = {"architecture": self.architecture, "scenario": self.scenario}
        known = {name: record for name, record in records.items() if record is not None}
        content = {
            "adeye": __version__,
            **fields_of(self, "kind", "step", "name", "seed"),
            "parameters": dict(self.parameters),
            **{name: record.model_dump(mode="json") for name, record in known.items()},
            "digests": {name: content_digest(record) for name, record in known.items()},
        }
        return json.dumps(content, sort_keys=True, separators=(",", ":"))

    @classmethod
    def read(cls, text: str) -> Export:
        """Read what ``text`` has written.

        Raises:
            UsageError: Another version of adeye has written it.
            IntegrityError: It has been changed.
        """
        content = json.loads(text)
        if (version := content.pop("adeye")) != __version__:
            raise UsageError(
                f"this FMU is of adeye {version}, not of {__version__}",
                remedy="Export it anew, or install that version.",
            )
        models: dict[str, type[Architecture | LogicalScenario]] = {
            "architecture": Architecture,
            "scenario": LogicalScenario,
        }
        for name, digest in content.pop("digests").items():
            content[name] = models[name].model_validate(content[name], context=SI)
            if content_digest(content[name]) != digest:
                raise IntegrityError(f"the {name} in this FMU is not as it was exported")
        return cls(**content)


def write_fmu(export: Export, path: Path) -> None:
    """Write a part of an architecture as an FMU, the same bytes each time.

    Args:
        export: What it is made from.
        path: Of the file.

    Raises:
        MissingExtra: pythonfmu3 is not installed.
        InputError: There is no such part that can be exported.
    """
    with needing("the export of an FMU", "fmi"):
        from pythonfmu3 import FmuBuilder
    # What cannot be exported is refused in words, before somebody else's code meets it.
    export.part()
    text = export.text()
    # Several may be loaded by one Python, which knows modules by their names only.
    module = f"{export.name or export.kind}_{hashlib.sha256(text.encode()).hexdigest()[:12]}"
    with tempfile.TemporaryDirectory(prefix="adeye_") as folder:
        script, source = Path(folder, f"{module}.py"), Path(folder, _CONTENT)
        script.write_text(_MODULE.format(version=__version__, name=module), "utf-8")
        source.write_text(text, "utf-8")
        made = FmuBuilder.build_FMU(script, folder, [source])
        with replacing(path) as place:
            _settle(made, place)


def _settle(made: Path, path: Path) -> None:
    """Write an archive again: without dates, in a fixed order, and ours at once to be known."""
    first = f"resources/{_CONTENT}"
    with zipfile.ZipFile(made) as found, zipfile.ZipFile(path, "w") as archive:
        for name in sorted(found.namelist(), key=lambda item: (item != first, item)):
            if name.startswith("sources/"):
                continue
            content = _DATE.sub(b"", found.read(name), count=1)
            item = zipfile.ZipInfo(name, _EPOCH)
            archive.writestr(item, content, zipfile.ZIP_DEFLATED)


class Served:
    """The part in an instance of an FMU, which asks it."""

    def __init__(self, fmu: Any) -> None:
        """Make the part, and tell the instance of its variables.

        Args:
            fmu: The instance, a ``pythonfmu3.Fmi3Slave``.

        Raises:
            UsageError: It is of another version of adeye.
        """
        import pythonfmu3 as fmi
        from pythonfmu3.unit import Unit

        text = Path(fmu.resources, _CONTENT).read_text("utf-8")
        self._part = part = Export.read(text).part()
        self._tick = 0
        self._fmu = fmu
        # No clock is read, and no dice are thrown.
        fmu.guid = uuid.uuid5(uuid.NAMESPACE_URL, f"adeye:{text}")
        fmu.version = __version__
        fmu.default_experiment = fmi.DefaultExperiment(0.0, None, part.step)
        time = fmi.Float64(
            "time", causality=fmi.Fmi3Causality.independent, getter=lambda: self._tick * part.step
        )
        fmu.register_variable(time, nested=False)
        listed = {"parameter": part.parameters, "input": part.inputs, "output": part.outputs}
        units = {value.unit for values in listed.values() for value in values} - {""}
        exponents = {
            name: zip(("m", "s", "rad"), UNITS[name].exponents, strict=True) for name in units
        }
        fmu.register_units([Unit(name, **dict(exponents[name])) for name in sorted(units)])
        for causality, values in listed.items():
            for value in values:
                fmu.register_variable(_variable(fmi, value, causality), nested=False)

    def begin(self) -> None:
        """Take the parameters."""
        self._part.begin()

    def step(self, time: float, size: float) -> Any:
        """Do what the part does from one tick to another.

        Args:
            time: Of the first one [s].
            size: Up to the second one [s].

        Returns:
            Whether that went well; what did not is told in the log and on standard error.
        """
        from pythonfmu3 import Fmi3Status, Fmi3StepResult

        try:
            self._step(time, size)
        except Exception as error:  # noqa: BLE001 - one that passes the FMU ends who imports it
            said = " ".join(f"{type(error).__name__}: {error}".split())
            self._fmu.log(said, Fmi3Status.error)
            sys.stderr.write(f"{said}\n")
            return Fmi3StepResult(Fmi3Status.error)
        return Fmi3StepResult()

    def _step(self, time: float, size: float) -> None:
        step = self._part.step
        count = round(size / step)
        is_whole = count >= 1 and abs(size - count * step) <= _SLACK * step
        if not is_whole or abs(time - self._tick * step) > _SLACK * step * max(1, self._tick):
            raise UsageError(
                f"a step of {size:g} s from {time:g} s does not fit",
                remedy=f"This FMU begins at 0 s and takes steps of {step:g} s.",
            )
        for _ in range(count):
            self._part.act(self._tick)
            self._tick += 1


def _variable(fmi: Any, value: parts.Value, causality: str) -> Any:
    """Make the variable of a number: it is held from step to step."""
    is_parameter = causality == "parameter"
    more: dict[str, Any] = {
        "causality": fmi.Fmi3Causality[causality],
        "variability": fmi.Fmi3Variability["fixed" if is_parameter else "discrete"],
        "description": value.text or None,
        "getter": value.get,
        "setter": None if causality == "output" else value.set,
    }
    kind = value.array.dtype.kind
    if kind == "f":
        return fmi.Float64(value.name, unit=value.unit or None, **more)
    return (fmi.Boolean if kind == "b" else fmi.Int64)(value.name, **more)
