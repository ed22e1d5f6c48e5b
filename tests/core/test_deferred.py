"""Test that xarray and pandas are imported when an attribute of them is read."""

from __future__ import annotations

import subprocess
import sys

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
