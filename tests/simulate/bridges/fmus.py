"""FMUs for tests: written in C, compiled where there is a compiler, for FMI 2.0 and 3.0."""

from __future__ import annotations

import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest

fmpy = pytest.importorskip("fmpy", reason="needs adeye[fmi]")

GUID = "{3f1c9c2e-0000-4000-8000-000000000001}"
HEADERS = Path(fmpy.__file__).parent / "c-code"

PART = r"""
#include <stdlib.h>
#include <string.h>
#include <stdio.h>
#include <math.h>
#include <signal.h>
#include <unistd.h>
#include "%(header)s"
typedef struct { double v[%(count)d]; double t; } Model;
static void step(double *v, double t, double h) { (void)t; (void)h; %(step)s }
"""

FMI2 = r"""
#define OK fmi2OK
#define S fmi2Status
#define C fmi2Component c
const char* fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char* fmi2GetVersion(void) { return fmi2Version; }
S fmi2SetDebugLogging(C, fmi2Boolean l, size_t n, const fmi2String k[]) { return OK; }
fmi2Component fmi2Instantiate(fmi2String i, fmi2Type y, fmi2String g, fmi2String r,
  const fmi2CallbackFunctions* f, fmi2Boolean w, fmi2Boolean l) {
  Model *m = calloc(1, sizeof(Model)); double s[] = {%(start)s};
  memcpy(m->v, s, sizeof s); return m; }
void fmi2FreeInstance(C) { free(c); }
S fmi2SetupExperiment(C, fmi2Boolean d, fmi2Real a, fmi2Real b, fmi2Boolean e, fmi2Real f) {
  return OK; }
S fmi2EnterInitializationMode(C) { return OK; }
S fmi2ExitInitializationMode(C) { step(((Model*)c)->v, 0.0, 0.0); return OK; }
S fmi2Terminate(C) { return OK; }
S fmi2Reset(C) { double s[] = {%(start)s}; memcpy(((Model*)c)->v, s, sizeof s); return OK; }
S fmi2GetReal(C, const fmi2ValueReference r[], size_t n, fmi2Real x[]) {
  for (size_t i = 0; i < n; i++) x[i] = ((Model*)c)->v[r[i]]; return OK; }
S fmi2SetReal(C, const fmi2ValueReference r[], size_t n, const fmi2Real x[]) {
  for (size_t i = 0; i < n; i++) ((Model*)c)->v[r[i]] = x[i]; return OK; }
S fmi2GetInteger(C, const fmi2ValueReference r[], size_t n, fmi2Integer x[]) { return fmi2Error; }
S fmi2GetBoolean(C, const fmi2ValueReference r[], size_t n, fmi2Boolean x[]) { return fmi2Error; }
S fmi2GetString(C, const fmi2ValueReference r[], size_t n, fmi2String x[]) { return fmi2Error; }
S fmi2SetInteger(C, const fmi2ValueReference r[], size_t n, const fmi2Integer x[]) {
  return fmi2Error; }
S fmi2SetBoolean(C, const fmi2ValueReference r[], size_t n, const fmi2Boolean x[]) {
  return fmi2Error; }
S fmi2SetString(C, const fmi2ValueReference r[], size_t n, const fmi2String x[]) {
  return fmi2Error; }
S fmi2GetFMUstate(C, fmi2FMUstate* s) {
  *s = malloc(sizeof(Model)); memcpy(*s, c, sizeof(Model)); return OK; }
S fmi2SetFMUstate(C, fmi2FMUstate s) { memcpy(c, s, sizeof(Model)); return OK; }
S fmi2FreeFMUstate(C, fmi2FMUstate* s) { free(*s); *s = 0; return OK; }
S fmi2SerializedFMUstateSize(C, fmi2FMUstate s, size_t* n) { return fmi2Error; }
S fmi2SerializeFMUstate(C, fmi2FMUstate s, fmi2Byte b[], size_t n) { return fmi2Error; }
S fmi2DeSerializeFMUstate(C, const fmi2Byte b[], size_t n, fmi2FMUstate* s) { return fmi2Error; }
S fmi2GetDirectionalDerivative(C, const fmi2ValueReference a[], size_t n,
  const fmi2ValueReference b[], size_t m, const fmi2Real d[], fmi2Real e[]) { return fmi2Error; }
S fmi2SetRealInputDerivatives(C, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
  const fmi2Real x[]) { return fmi2Error; }
S fmi2GetRealOutputDerivatives(C, const fmi2ValueReference r[], size_t n, const fmi2Integer o[],
  fmi2Real x[]) { return fmi2Error; }
S fmi2DoStep(C, fmi2Real t, fmi2Real h, fmi2Boolean b) {
  step(((Model*)c)->v, t, h); return %(status)s; }
S fmi2CancelStep(C) { return fmi2Error; }
S fmi2GetStatus(C, const fmi2StatusKind k, fmi2Status* x) { return fmi2Error; }
S fmi2GetRealStatus(C, const fmi2StatusKind k, fmi2Real* x) { return fmi2Error; }
S fmi2GetIntegerStatus(C, const fmi2StatusKind k, fmi2Integer* x) { return fmi2Error; }
S fmi2GetBooleanStatus(C, const fmi2StatusKind k, fmi2Boolean* x) { return fmi2Error; }
S fmi2GetStringStatus(C, const fmi2StatusKind k, fmi2String* x) { return fmi2Error; }
"""

DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="%(name)s" guid="%(guid)s">
  <CoSimulation modelIdentifier="%(name)s" canHandleVariableCommunicationStepSize="true"
    canGetAndSetFMUstate="true"/>
%(units)s  <ModelVariables>
%(variables)s  </ModelVariables>
  <ModelStructure>
%(structure)s  </ModelStructure>
</fmiModelDescription>
"""


@dataclass(frozen=True)
class Var:
    """A variable: its name, causality, start value and unit."""

    name: str
    causality: str
    start: float = 0.0
    unit: str = ""
    variability: str = "continuous"


def build_fmu(
    folder: Path,
    name: str,
    variables: list[Var],
    step: str,
    *,
    status: str = "fmi2OK",
    units: dict[str, str] | None = None,
) -> Path:
    """Compile an FMU of FMI 2.0 whose step is C on the array ``v`` of its variables.

    Args:
        folder: Where the file goes.
        name: Of the model.
        variables: In the order of ``v``.
        step: Statements on ``v``, ``t`` and ``h``; they also run once without length at the start.
        status: What ``fmi2DoStep`` returns.
        units: Name of each unit and the attributes of its base unit.
    """
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("there is no C compiler")
    work = folder / f"{name}.build"
    work.mkdir(parents=True)
    start = ", ".join(repr(item.start) for item in variables)
    fill = {"header": "fmi2Functions.h", "count": len(variables), "step": step}
    source = PART % fill + FMI2 % {"start": start, "status": status}
    (work / "model.c").write_text(source)
    library = work / f"{name}.so"
    options = ["-shared", "-fPIC", "-w", "-O1", f"-I{HEADERS}", "-o", str(library)]
    command = [compiler, *options, str(work / "model.c"), "-lm"]
    subprocess.run(command, check=True)
    file = folder / f"{name}.fmu"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("modelDescription.xml", _description(name, variables, units or {}))
        archive.write(library, f"binaries/linux64/{name}.so")
    return file


def _description(name: str, variables: list[Var], units: dict[str, str]) -> str:
    lines, outputs = [], []
    for row, item in enumerate(variables):
        attributes = f'name={quoteattr(item.name)} valueReference="{row}"'
        if item.causality == "parameter":
            attributes += ' causality="parameter" variability="fixed"'
        else:
            attributes += f' causality="{item.causality}" variability="{item.variability}"'
        if item.causality == "local":
            attributes += ' initial="exact"'
        if item.causality == "output":
            outputs.append(row + 1)
            attributes += ' initial="calculated"'
        unit = f" unit={quoteattr(item.unit)}" if item.unit else ""
        value = "" if item.causality == "output" else f' start="{item.start!r}"'
        lines.append(f"    <ScalarVariable {attributes}><Real{unit}{value}/></ScalarVariable>\n")
    unknowns = "".join(f'<Unknown index="{row}"/>' for row in outputs)
    structure = f"    <Outputs>{unknowns}</Outputs>\n" if outputs else ""
    if outputs:
        structure += f"    <InitialUnknowns>{unknowns}</InitialUnknowns>\n"
    named = {item.unit: "" for item in variables if item.unit} | units
    defined = "".join(
        f"    <Unit name={quoteattr(unit)}>{f'<BaseUnit {base}/>' if base else ''}</Unit>\n"
        for unit, base in named.items()
    )
    return DESCRIPTION % {
        "name": name,
        "guid": GUID,
        "units": f"  <UnitDefinitions>\n{defined}  </UnitDefinitions>\n" if named else "",
        "variables": "".join(lines),
        "structure": structure,
    }


SI = {
    "m/s": 'm="1" s="-1"',
    "km/h": 'm="1" s="-1" factor="0.277777777777777778"',
    "m/s2": 'm="1" s="-2"',
    "rad": 'rad="1"',
    "deg": 'rad="1" factor="0.0174532925199432958"',
    "kg": 'kg="1"',
}
"""Units that descriptions of tests define."""


def cruise(folder: Path, step: str = "", name: str = "cruise", **more: str) -> Path:
    """Build a controller: ``v[2] = gain (wanted - speed)``, straight on, then what else it does."""
    variables = [
        Var("speed", "input", unit="km/h"),
        Var("gain", "parameter", 0.4),
        Var("a", "output", unit="m/s2"),
        Var("delta", "output", unit="deg"),
        Var("wanted", "input", unit="m/s"),
    ]
    law = f"v[2] = v[1] * (v[4] - v[0] / 3.6); v[3] = 0.0; {step}"
    return build_fmu(folder, name, variables, law, units=SI, **more)


def car(folder: Path, step: str = "", name: str = "car", **more: str) -> Path:
    """Build a vehicle: single-track without slip and lags, then what else it does."""
    variables = [
        Var("acc", "input", unit="m/s2"),
        Var("steer", "input", unit="rad"),
        *(Var(item, "parameter") for item in ("x0", "y0", "psi0", "v0")),
        *(Var(item, "output") for item in ("x", "y", "psi", "v")),
        Var("begun", "local"),
    ]
    law = f"""
        if (!v[10]) {{ v[6] = v[2]; v[7] = v[3]; v[8] = v[4]; v[9] = v[5]; v[10] = 1; }}
        for (int i = 0; i < 100 && h > 0; i++) {{
            double k = h / 100, slip = atan(0.5 * tan(v[1]));
            v[9] = fmax(0.0, v[9] + k * v[0]);
            v[6] += k * v[9] * cos(v[8] + slip); v[7] += k * v[9] * sin(v[8] + slip);
            v[8] += k * v[9] * 2 * sin(slip) / 2.9; }}
        {step}"""
    return build_fmu(folder, name, variables, law, units=SI, **more)
