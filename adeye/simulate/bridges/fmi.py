"""What the description of an FMU says, and how its variables are wired to signals of adeye.

An FMU's binary is never loaded here: that is for ``fmu_program``, in a process of its own.
"""

from __future__ import annotations

import math
import stat
import zipfile
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from adeye.errors import SpecError, needing, suggest
from adeye.simulate.bridges.fmu_program import ENDS
from adeye.units import UNITS, shown

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from adeye.units import Dimension

LARGEST: Final = 2**30
"""Most bytes that the files of an FMU may have when they are extracted."""
MOST_FILES: Final = 10_000
LARGEST_DESCRIPTION: Final = 2**25
"""Most bytes of its ``modelDescription.xml``."""
DESCRIPTION: Final = "modelDescription.xml"
FLOATS: Final = frozenset({"Real", "Float64", "Float32"})
NUMBERS: Final = (
    FLOATS
    | {"Integer", "Boolean", "Enumeration"}
    | {f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)}
)
"""Types of variables that take and give numbers."""
_WHOLE: Final = frozenset({"object", "present", "seed"})
"""Signals that are whole numbers or truths; another type would take something else for others."""


@dataclass(frozen=True, slots=True)
class Variable:
    """A variable of an FMU.

    Attributes:
        name: As its description has it.
        kind: Type, such as ``Float64``.
        causality: Such as ``input``.
        variability: Such as ``continuous``.
        unit: Empty for none.
        start: As written; empty for none.
        is_scalar: Whether it is no array.
    """

    name: str
    kind: str
    causality: str
    variability: str
    unit: str
    start: str
    is_scalar: bool


@dataclass(frozen=True, slots=True)
class Description:
    """What an FMU says of itself.

    Attributes:
        version: Of FMI.
        model: Name of the model.
        tool: That wrote it; empty if it does not say.
        is_steppable: Whether it can be used for co-simulation.
        has_state: Whether its state can be kept and brought back.
        variables: By name.
        units: Of each unit that it defines as SI units: the exponents of length, time and angle,
            factor and offset; None where it has others.
    """

    version: str
    model: str
    tool: str
    is_steppable: bool
    has_state: bool
    variables: Mapping[str, Variable]
    units: Mapping[str, tuple[tuple[int, int, int], float, float] | None]


@dataclass(frozen=True, slots=True)
class Wire:
    """How a signal and a variable correspond: ``variable = signal / factor - offset / factor``.

    Attributes:
        signal: Name of it, or key of a record that names the variable.
        variable: Name of it.
        factor: SI units that the variable's unit is.
        offset: SI value where the variable is 0.
    """

    signal: str
    variable: str
    factor: float
    offset: float

    def to_variable(self, value: Any) -> Any:
        """Convert values in SI to the variable's unit."""
        return (value - self.offset) / self.factor

    def to_signal(self, value: Any) -> Any:
        """Convert values in the variable's unit to SI."""
        return value * self.factor + self.offset


def require_fmpy() -> Any:
    """Import fmpy.

    Raises:
        MissingExtra: It is not installed.
    """
    with needing("an FMU", "fmi"):
        import fmpy
    return fmpy


def read_description(path: Path) -> Description:
    """Read what an FMU says of itself.

    Raises:
        MissingExtra: fmpy is not installed.
        SpecError: It is no FMU, or one that is not safe to extract.
    """
    fmpy = require_fmpy()
    _require_harmless(path)
    try:
        found = fmpy.read_model_description(str(path))
        return _described(found)
    except Exception as error:
        said = " ".join(str(error).split())[:300]
        raise SpecError(
            f"{shown(path.name)} has no valid description: {said}",
            remedy="FMUs of FMI 2.0 and 3.0 for co-simulation are understood;"
            f" fmpy validate {path.name} lists what is wrong.",
        ) from error


def _require_harmless(path: Path) -> None:
    """Refuse an archive that would write outside of a folder, or too much."""
    if not path.is_file():
        raise SpecError(f"there is no file {shown(str(path))}", remedy="Check the path.")
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except (OSError, zipfile.BadZipFile, ValueError) as error:
        raise SpecError(
            f"{shown(path.name)} is no FMU: {error}", remedy="An FMU is a ZIP archive."
        ) from error
    wrong = next((name for item in members if (name := _harm(item))), "")
    total = sum(item.file_size for item in members)
    if not wrong and len(members) > MOST_FILES:
        wrong = f"has {len(members)} files, more than {MOST_FILES}"
    if not wrong and total > LARGEST:
        wrong = f"would be {total / 2**30:.1f} GiB, more than {LARGEST / 2**30:g} GiB"
    if wrong:
        raise SpecError(f"{shown(path.name)} {wrong}", remedy="Ask whoever made it for another.")


def _harm(item: zipfile.ZipInfo) -> str:
    name = item.filename
    parts = name.replace("\\", "/").split("/")
    if ".." in parts or name.startswith(("/", "\\")) or ":" in name or "\\" in name:
        return f"has a file outside of its folder: {shown(name)}"
    if stat.S_ISLNK(item.external_attr >> 16):
        return f"has a link: {shown(name)}"
    if name == DESCRIPTION and item.file_size > LARGEST_DESCRIPTION:
        return f"has a description of {item.file_size / 2**20:.0f} MiB"
    return ""


def _described(found: Any) -> Description:
    steps = found.coSimulation
    return Description(
        version=found.fmiVersion,
        model=found.modelName,
        tool=found.generationTool or "",
        is_steppable=steps is not None and found.fmiVersion in {"2.0", "3.0"},
        has_state=bool(steps is not None and steps.canGetAndSetFMUstate),
        variables={
            item.name: Variable(
                name=item.name,
                kind=item.type,
                causality=item.causality or "local",
                variability=item.variability or "continuous",
                unit=item.unit or (item.declaredType.unit if item.declaredType else "") or "",
                start="" if item.start is None else str(item.start),
                is_scalar=not item.dimensions,
            )
            for item in found.modelVariables
        },
        units={
            item.name: _in_si(item.baseUnit)
            for item in found.unitDefinitions
            if item.baseUnit is not None
        },
    )


def _in_si(base: Any) -> tuple[tuple[int, int, int], float, float] | None:
    if base.kg or base.A or base.K or base.mol or base.cd:
        return None
    return (base.m, base.s, base.rad), float(base.factor), float(base.offset)


def wire(
    description: Description, wanted: Iterable[tuple[str, str, Dimension]], causality: str
) -> list[Wire]:
    """Connect signals with variables, and check that they fit.

    Args:
        description: Of the FMU.
        wanted: Signal, name of the variable, and what the signal measures.
        causality: What the variables must be: ``input`` or ``output``.

    Raises:
        SpecError: There is no such variable, its type or what it is does not fit, or its unit
            measures something else.
    """
    wires = []
    for signal, name, dimension in wanted:
        variable = variable_of(description, name, causality)
        is_whole = signal.rpartition(".")[2] in _WHOLE
        if variable.kind not in (NUMBERS if is_whole else FLOATS):
            what = "number" if is_whole else "number with a fraction"
            raise SpecError(
                f"variable {shown(name)} of the FMU is {variable.kind}, no {what}",
                remedy="Name a variable that is one.",
            )
        wires.append(Wire(signal, name, *_scale(description, variable, dimension)))
    return wires


def variable_of(description: Description, name: str, causality: str) -> Variable:
    """Return a variable of one value that is an ``input`` or an ``output``.

    Raises:
        SpecError: There is none of that name, it is something else, or an array.
    """
    variable = description.variables.get(name)
    known = [n for n, item in description.variables.items() if item.causality == causality]
    if variable is None:
        raise SpecError(f"the FMU has no variable {shown(name)}", remedy=suggest(name, known))
    if variable.causality != causality:
        raise SpecError(
            f"variable {shown(name)} of the FMU is no {causality} but {variable.causality}",
            remedy=f"Its {causality}s are {', '.join(known[:20]) or 'none'}.",
        )
    if not variable.is_scalar:
        raise SpecError(
            f"variable {shown(name)} of the FMU is an array", remedy="Name one of a single value."
        )
    return variable


def _scale(
    description: Description, variable: Variable, dimension: Dimension
) -> tuple[float, float]:
    """Return factor and offset of the unit of a variable; that of one without is SI."""
    if not variable.unit:
        return 1.0, 0.0
    told = description.units.get(variable.unit)
    if variable.unit not in description.units and variable.unit in UNITS:
        unit = UNITS[variable.unit]
        told = unit.exponents, unit.numerator / unit.denominator, 0.0
    where = f"variable {shown(variable.name)} of the FMU has the unit {shown(variable.unit)}"
    if told is None:
        raise SpecError(
            f"{where}, which it does not define by metre, second and radian",
            remedy="Define it in the FMU, or leave its unit away and give it in SI.",
        )
    exponents, factor, offset = told
    if not (math.isfinite(factor) and factor != 0.0 and math.isfinite(offset)):
        raise SpecError(
            f"{where}, whose factor is {factor} and whose offset is {offset}",
            remedy="Mend the unit in the FMU: its factor is a finite number other than 0.",
        )
    # An angle may be told as a plain number, as SI has it.
    if exponents[:2] != dimension.exponents[:2] or exponents[2] not in {0, dimension.exponents[2]}:
        raise SpecError(
            f"{where}, which is not that of {dimension.label}",
            remedy="Wire it to another signal, or mend its unit.",
        )
    return factor, offset


def require_steppable(description: Description, name: str) -> None:
    """Refuse an FMU that cannot be used for co-simulation.

    Raises:
        SpecError: It is for model exchange only, or of another version.
    """
    if not description.is_steppable:
        raise SpecError(
            f"{shown(name)} is of FMI {description.version} without co-simulation",
            remedy="Export it for co-simulation, as FMI 2.0 or 3.0.",
        )


def takes(kind: str, value: Any) -> bool:
    """Return whether variables of a type take a value as it is, without rounding or wrapping.

    >>> takes("Int8", 127), takes("Int8", 128), takes("Int64", 2.7), takes("Float64", math.nan)
    (True, False, False, False)
    """
    if kind not in NUMBERS:
        return kind == "String" and isinstance(value, str)
    if not isinstance(value, int | float) or not math.isfinite(value):
        return False
    if kind in FLOATS or isinstance(value, bool) or kind == "Boolean":
        return isinstance(value, bool) is (kind == "Boolean")
    low, high = ENDS.get(kind, ENDS["Int32"])
    return value == int(value) and low <= value <= high


def require_start(description: Description, start: Mapping[str, Any]) -> None:
    """Refuse start values that the FMU does not take.

    Raises:
        SpecError: There is no such variable, it cannot be set, or the value is not of its type.
    """
    for name, value in start.items():
        variable = description.variables.get(name)
        if variable is None:
            raise SpecError(
                f"the FMU has no variable {shown(name)}",
                remedy=suggest(name, description.variables),
            )
        if not takes(variable.kind, value) or not variable.is_scalar:
            raise SpecError(
                f"start value {shown(value)} is none of {variable.kind} {shown(name)}",
                remedy="Numbers that the type holds, true, false, and text for String.",
            )
        # An output without a start value of its own is calculated.
        is_told = variable.causality == "output" and not variable.start
        if variable.variability == "constant" or variable.causality == "independent" or is_told:
            raise SpecError(
                f"variable {shown(name)} of the FMU cannot be set",
                remedy="Start values are for parameters, inputs and states.",
            )
