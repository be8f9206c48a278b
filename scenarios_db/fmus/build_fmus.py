"""Build the FMUs of the catalogue: a vehicle with slip, a controller for speed and lane, a radar.

    python scenarios_db/fmus/build_fmus.py [FOLDER]

The files are what counts; this says how they came about and builds them again, for FMI 2.0 and
64-bit Linux. Their C stands in them as ``sources/model.c``.

Needs a C compiler, and the headers of FMI that fmpy (BSD-2-Clause) has.
"""

import shutil
import subprocess
import sys
import tempfile
import zipfile
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import fmpy

FOLDER = Path(__file__).resolve().parents[2] / "odd" / "architectures" / "fmus"

GUID = "{3f1c9c2e-0000-4000-8000-000000000001}"

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


SI = {
    "m/s": 'm="1" s="-1"',
    "km/h": 'm="1" s="-1" factor="0.277777777777777778"',
    "m/s2": 'm="1" s="-2"',
    "rad": 'rad="1"',
    "deg": 'rad="1" factor="0.0174532925199432958"',
    "kg": 'kg="1"',
}
"""Units that descriptions of tests define."""


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
    headers = Path(fmpy.__file__).parent / "c-code"
    work = Path(tempfile.mkdtemp(prefix="fmu-"))
    start = ", ".join(repr(item.start) for item in variables)
    fill = {"header": "fmi2Functions.h", "count": len(variables), "step": step}
    source = PART % fill + FMI2 % {"start": start, "status": status}
    (work / "model.c").write_text(source)
    library = work / f"{name}.so"
    options = ["-shared", "-fPIC", "-w", "-O1", f"-I{headers}", "-o", str(library)]
    command = ["cc", *options, str(work / "model.c"), "-lm"]
    subprocess.run(command, check=True)  # noqa: S603 - a compiler and our own source
    file = folder / f"{name}.fmu"
    members = {
        "modelDescription.xml": _description(name, variables, units or {}).encode(),
        f"binaries/linux64/{name}.so": library.read_bytes(),
        "sources/model.c": source.encode(),
    }
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for member, content in members.items():
            # The same files, whenever they are packed.
            archive.writestr(zipfile.ZipInfo(member), content, zipfile.ZIP_DEFLATED)
    shutil.rmtree(work)
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


VEHICLE = [
    Var("a_cmd", "input", unit="m/s2"),
    Var("delta_cmd", "input", unit="rad"),
    Var("mu", "input", 0.9),
    *(Var(name, "parameter") for name in ("x0", "y0", "psi0")),
    Var("v0", "parameter", unit="m/s"),
    Var("mass", "parameter", 1800.0),
    Var("cornering_stiffness", "parameter", 90000.0),
    *(Var(name, "output") for name in ("x", "y", "psi")),
    Var("v", "output", unit="m/s"),
    Var("a", "output", unit="m/s2"),
    Var("delta", "output", unit="rad"),
    Var("yaw_rate", "output"),
    Var("vy", "local"),
    Var("has_begun", "local"),
    Var("drive", "local", unit="m/s2"),
]
"""A single-track model with linear tyres of limited grip, lags of drive and steering.

What the drive gives is ``drive``; the acceleration ``a`` is what grip leaves of it, and nothing
once the vehicle stands.
"""

VEHICLE_STEP = r"""
    const double g = 9.81, l = 1.45, iz = 1.6 * v[7];
    if (!v[17]) { v[9] = v[3]; v[10] = v[4]; v[11] = v[5]; v[12] = v[6]; v[17] = 1; }
    const int n = 50;
    const double k = h / n;
    for (int i = 0; i < n && h > 0; i++) {
        v[18] += k * (v[0] - v[18]) / 0.15;
        v[14] += k * (v[1] - v[14]) / 0.1;
        double most = v[2] * v[7] * g / 2, u = v[12];
        if (u < 3.0) {  /* slip angles mean nothing while it creeps */
            v[16] = 0.0;
            v[15] = u * tan(v[14]) / (2 * l);
        } else {
            double front = v[8] * (v[14] - atan2(v[16] + l * v[15], u));
            double rear = -v[8] * atan2(v[16] - l * v[15], u);
            front = fmax(-most, fmin(most, front));
            rear = fmax(-most, fmin(most, rear));
            v[16] += k * ((front + rear) / v[7] - u * v[15]);
            v[15] += k * l * (front - rear) / iz;
        }
        v[13] = fmax(-v[2] * g, fmin(v[2] * g, v[18]));
        if (u + k * v[13] <= 0.0) v[13] = -u / k;
        v[12] = fmax(0.0, u + k * v[13]);
        v[9] += k * (v[12] * cos(v[11]) - v[16] * sin(v[11]));
        v[10] += k * (v[12] * sin(v[11]) + v[16] * cos(v[11]));
        v[11] += k * v[15];
    }
"""

CONTROLLER = [
    Var("v", "input", unit="km/h"),
    Var("v_set", "input", unit="km/h"),
    Var("gap", "input", 1000.0),
    Var("v_lead", "input", unit="m/s"),
    Var("offset", "input"),
    Var("heading", "input", unit="rad"),
    Var("curvature", "input"),
    Var("time_gap", "parameter", 1.8),
    Var("a", "output", unit="m/s2"),
    Var("delta", "output", unit="deg"),
]
"""The intelligent driver model for the speed, and feedback of offset and heading for the lane."""

CONTROLLER_STEP = r"""
    double u = v[0] / 3.6, want = fmax(v[1] / 3.6, 0.1), closing = u - v[3];
    double gap = 4.0 + fmax(0.0, u * v[7] + u * closing / (2 * sqrt(1.5 * 2.5)));
    double free = u / want, near = gap / fmax(v[2], 0.1);
    v[8] = fmax(-8.0, 1.5 * (1 - free * free * free * free - near * near));
    v[9] = 57.29577951308232 * (atan(2.9 * v[6]) - 0.5 * v[5] - 0.02 * v[4]);
"""


SEEN = 4
"""How many objects the radar is told of."""

TOLD = ("there", "x", "y", "vx", "vy")
FOUND = ("found", "rx", "ry", "rate")

RADAR = [
    *(Var(f"{name}{number}", "input") for number in range(SEEN) for name in TOLD),
    Var("rain", "input", unit="m/s"),
    Var("range", "parameter", 70.0),
    Var("half_angle", "parameter", 0.5, unit="rad"),
    Var("noise", "parameter", 0.2),
    Var("seed", "parameter", 1.0),
    *(Var(f"{name}{number}", "output") for number in range(SEEN) for name in FOUND),
    Var("state", "local"),
]
"""A short-range radar: range, angle, rain that shortens the range, evenly spread noise."""

RADAR_STEP = r"""
    const double *told = v, *p = v + 20; double *found = v + 25, *state = v + 41;
    if (*state == 0.0) *state = fmod(p[4], 2147483646.0) + 1.0;
    for (int i = 0; i < 4; i++, told += 5, found += 4) {
        double r = hypot(told[1], told[2]);
        double most = p[1] / (1.0 + p[0] * 3.6e6 / 50.0);
        found[0] = told[0] > 0.5 && r < most && fabs(atan2(told[2], told[1])) < p[2];
        *state = fmod(16807.0 * *state, 2147483647.0);
        double off = found[0] ? p[3] * (2.0 * *state / 2147483647.0 - 1.0) : 0.0;
        found[1] = r > 0.0 ? told[1] * (1.0 + off / r) : 0.0;
        found[2] = r > 0.0 ? told[2] * (1.0 + off / r) : 0.0;
        found[3] = r > 0.0 ? (told[1] * told[3] + told[2] * told[4]) / r : 0.0;
    }
"""


def main(folder: Path) -> None:
    """Build all."""
    build_fmu(folder, "single_track", VEHICLE, VEHICLE_STEP, units=SI)
    build_fmu(folder, "follow_and_keep", CONTROLLER, CONTROLLER_STEP, units=SI)
    build_fmu(folder, "short_radar", RADAR, RADAR_STEP, units=SI)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER)
