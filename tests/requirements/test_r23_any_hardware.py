"""R23: no tie to a hardware configuration: the same bits whatever the processor offers."""

import json
from importlib.metadata import requires
from pathlib import Path

import pytest

from tests.conftest import MakeProject
from tests.processes import ROOT, python
from tests.project import Project

pytestmark = pytest.mark.requirements

# Machine code that these switch off is what libm and NumPy choose by processor; the third compiles
# every kernel for a processor without any extension.
MASKS = {
    "glibc": {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA,-AVX2_Usable,-FMA_Usable,-FMA4"},
    "numpy": {"NPY_DISABLE_CPU_FEATURES": "X86_V4 X86_V3 AVX512_ICL AVX512_SPR"},
}

BITS = """
import json, sys
from adeye.campaign.plan import make_plan
from adeye.campaign.work import BatchTask, execute
from adeye import engine
from adeye.sweep.case import batches

plan = make_plan(sys.argv[1])
found = {}
for cases in batches(plan.cases, 64):
    trace = engine.run(cases, backend=plan.engine.backend, base_dirs=plan.folders)
    found |= dict(zip((case.digest for case in cases), trace.digests()))
print(json.dumps(found))
"""


def bits(project: Project, **environment: str) -> dict[str, str]:
    """Trace digest by test case, computed in a process of its own."""
    ended = python("-c", BITS, project.odd, cwd=ROOT, **environment)
    assert ended.returncode == 0, ended.stderr
    assert "Unknown CPU features" not in ended.stderr
    found: dict[str, str] = json.loads(ended.stdout)
    assert len(found) == 28
    return found


@pytest.mark.slow
@pytest.mark.parametrize("mask", MASKS)
def test_masked_processor_features_change_no_bit(make_project: MakeProject, mask: str) -> None:
    project = make_project()
    assert bits(project, **MASKS[mask]) == bits(project)


@pytest.mark.slow
def test_kernels_compiled_for_any_processor_give_the_same_bits(
    make_project: MakeProject, tmp_path: Path
) -> None:
    project = make_project()
    generic = bits(project, NUMBA_CPU_NAME="generic", NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert generic == bits(project)


def test_nothing_that_adeye_needs_is_tied_to_a_graphics_processor() -> None:
    core = [line for line in requires("adeye") or () if "extra ==" not in line]
    assert len(core) >= 13
    assert not [line for line in core if "cuda" in line or "cupy" in line or "torch" in line]
