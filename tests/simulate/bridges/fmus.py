"""FMUs for tests: written in C, compiled where there is a compiler."""

import shutil
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("fmpy", reason="needs adeye[fmi]")

ROOT = Path(__file__).resolve().parents[3]
SHIPPED = ROOT / "odd" / "architectures" / "fmus"


def _builder() -> Any:
    """Load the script that has built the FMUs of the catalogue."""
    spec = spec_from_file_location("build_fmus", ROOT / "scenarios_db" / "fmus" / "build_fmus.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[spec.name] = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


builder = _builder()
Var, SI = builder.Var, builder.SI


def build_fmu(*given: Any, **more: Any) -> Path:
    """Build an FMU as the script does, where there is a compiler."""
    if shutil.which("cc") is None:
        pytest.skip("there is no C compiler")
    path: Path = builder.build_fmu(*given, **more)
    return path


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
        Var("rate", "output"),
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
