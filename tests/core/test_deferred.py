"""Libraries are imported at their first use, and Gymnasium gets the environments then."""

from __future__ import annotations

import subprocess
import sys

import pytest
import xarray

from baldwinlab.core.deferred import pd, xr

CODE = """
import sys
from baldwinlab.core.deferred import xr
assert "xarray" not in sys.modules
xr.Dataset
assert "xarray" in sys.modules
"""


def test_a_module_is_imported_when_it_is_used() -> None:
    subprocess.run([sys.executable, "-c", CODE], check=True)


def test_attributes_are_those_of_the_module() -> None:
    assert xr.Dataset is xarray.Dataset
    assert pd.DataFrame.__module__.startswith("pandas")


@pytest.mark.parametrize("imports", ["baldwinlab, gymnasium", "gymnasium, baldwinlab", "gymnasium"])
def test_the_environment_is_registered_in_any_order_of_imports(imports: str) -> None:
    prefix = "" if "baldwinlab" in imports else "baldwinlab:"
    code = f"""
import {imports}
assert gymnasium.spec("CartPole-v1")
gymnasium.envs.registration._find_spec("{prefix}baldwinlab/Forager-v0")
import sys
assert "numba" not in sys.modules
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_the_package_does_not_import_gymnasium_and_works_without_it() -> None:
    code = """
import sys, baldwinlab
assert "gymnasium" not in sys.modules
sys.modules["gymnasium"] = None
try:
    import gymnasium
except ImportError:
    sys.exit(0)
sys.exit(1)
"""
    subprocess.run([sys.executable, "-c", code], check=True)
