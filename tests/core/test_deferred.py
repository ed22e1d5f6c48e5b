"""Libraries are imported at their first use, and Gymnasium gets the environments then."""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, wait
from types import ModuleType
from unittest.mock import patch

import pytest
import xarray

from baldwinlab.core import deferred
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


def test_one_thread_imports_at_a_time() -> None:
    """Two threads in modules that import each other would get an incomplete module."""
    lengths: list[int] = []
    importing: list[str] = []

    def import_slowly(name: str) -> ModuleType:
        importing.append(name)
        lengths.append(len(importing))
        time.sleep(0.02)
        importing.remove(name)
        return ModuleType(name)

    with patch.object(deferred, "import_module", import_slowly), ThreadPoolExecutor(4) as pool:
        tasks = [pool.submit(deferred.import_netcdf_reader) for _ in range(2)]
        tasks += [pool.submit(getattr, module, "__doc_", None) for module in (pd, xr)]
        wait(tasks)
    assert len(lengths) >= 4
    assert {*lengths} == {1}


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
