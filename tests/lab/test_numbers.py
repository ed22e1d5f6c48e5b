"""Numbers of the lab's pages: a value that is not 0 is never shown as 0."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from baldwinlab.lab.pages.single_page import STATIC_FOLDER

SCRIPT = """
globalThis.document = { documentElement: { lang: "en" } };
globalThis.matchMedia = () => ({ matches: false, addEventListener() {} });
globalThis.addEventListener = () => {};
const { formatNumber, formatPercentage } = await import(MODULE);
const numbers = [12345, 12.34, 0.034, 0.000647, -1e-10, 0];
const shares = [0, 0.34, 0.0034, 0.9996, 1];
console.log(JSON.stringify([numbers.map(formatNumber), shares.map(formatPercentage)]));
"""


def test_small_numbers_and_shares_are_not_0(tmp_path: Path) -> None:
    node = shutil.which("node")
    if node is None:
        pytest.skip("Node is not installed")
    script = tmp_path / "run.mjs"
    module = (STATIC_FOLDER / "core/common.js").as_uri()
    script.write_text(SCRIPT.replace("MODULE", json.dumps(module)))
    result = subprocess.run([node, script], capture_output=True, text=True, check=True)
    numbers, shares = json.loads(result.stdout)
    assert numbers == ["12,345", "12.3", "0.034", "6.5e-04", "-1.0e-10", "0"]
    assert shares == ["0 %", "34 %", "0.3 %", "99.96 %", "100 %"]
