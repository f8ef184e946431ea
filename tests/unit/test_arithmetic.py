"""The code of NumPy's linear algebra and elementary functions is that of AVX2, whatever else the processor has."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from gaplab.arithmetic import FIXED, chosen, fix_arithmetic, has
from gaplab.services.running.versions import provenance
from tests.arithmetic import code_of_numpy

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(not has("avx2"), reason="the processor has no AVX2")
FREE = {name: value for name, value in os.environ.items() if name not in FIXED}


def code_of_a_process(environment: Any) -> Any:
    """The code of NumPy's linear algebra, and its elementary functions, in a new process that imports gaplab first."""
    told = "import sys, gaplab; assert 'numpy' not in sys.modules; from tests.arithmetic import told; print(told())"
    found = subprocess.run([sys.executable, "-c", told], env=environment, cwd=ROOT, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    return found.stdout.strip()


def test_a_process_that_imports_gaplab_runs_the_code_for_avx2() -> None:
    assert code_of_a_process(FREE) == "Haswell, X86_V2 X86_V3"


def test_what_the_environment_says_counts() -> None:
    other = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}

    assert code_of_a_process(FREE | other) == "Nehalem, X86_V2"


def test_the_tests_themselves_run_the_code_for_avx2() -> None:
    assert code_of_numpy() == chosen()["OPENBLAS_CORETYPE"]


def test_nothing_is_chosen_on_a_processor_without_avx2(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gaplab.arithmetic.has", lambda _: False)
    for name in FIXED:
        monkeypatch.delenv(name)

    fix_arithmetic()

    assert chosen() == {}


def test_the_provenance_of_results_names_the_code() -> None:
    assert provenance().libraries.items() >= chosen().items()
    assert chosen().keys() == FIXED.keys()
