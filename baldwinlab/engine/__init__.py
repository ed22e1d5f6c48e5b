"""The engine: compilation with Numba.

The engine refuses versions of packages that it was not tested with. `numba_internals` uses private
names of Numba, llvmlite and numba-cuda, which any minor release may change. numba-cuda uses
`np.row_stack`, which NumPy 2.5 removed. `pyproject.toml` declares the same bounds.
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

from baldwinlab._version import __version__
from baldwinlab.core.errors import RefusedError
from baldwinlab.core.numbers import name_variable_in_errors

with name_variable_in_errors("NUMBA_NUM_THREADS"):
    import llvmlite
    import numba

Version = tuple[int, int]  # major and minor


class TestedVersions(NamedTuple):
    """The lowest and the highest tested minor version of a package, both included."""

    lowest: Version
    highest: Version
    user: str = "baldwinlab"  # the program that needs these versions, for the error message

    @property
    def requirement(self) -> str:
        """The versions as pip writes them: ">=0.62,<0.69"."""
        (low_major, low_minor), (high_major, high_minor) = self.lowest, self.highest
        return f">={low_major}.{low_minor},<{high_major}.{high_minor + 1}"


TESTED: Final = {
    "numba": TestedVersions((0, 62), (0, 68)),
    "llvmlite": TestedVersions((0, 45), (0, 50)),
    "numba-cuda": TestedVersions((0, 30), (0, 30)),
    # Without a GPU, later versions work too.
    "numpy": TestedVersions((2, 1), (2, 4), user="the GPU backend of baldwinlab"),
}


def require_tested_version(package: str, version: str) -> None:
    """Refuse a version of a package that baldwinlab was not tested with."""
    tested = TESTED[package]
    # Major and minor version: "0.62.1" becomes (0, 62).
    installed = tuple(map(int, re.findall(r"\d+", version)[:2]))
    if tested.lowest <= installed <= tested.highest:
        return
    lowest, highest = (f"{major}.{minor}" for major, minor in tested[:2])
    works_with = lowest if lowest == highest else f"{lowest} to {highest}"
    raise RefusedError(
        f"{package} {version} has not been tested with {tested.user} {__version__}, which works "
        f"with {package} {works_with}: pip install '{package}{tested.requirement}'"
    )


require_tested_version("numba", numba.__version__)
require_tested_version("llvmlite", llvmlite.__version__)
