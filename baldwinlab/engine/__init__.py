"""The engine: compilation with Numba. It refuses versions of Numba that it was not tested with."""

from baldwinlab.core.numbers import name_variable_in_errors
from baldwinlab.engine.versions import require_tested_version

with name_variable_in_errors("NUMBA_NUM_THREADS"):
    import llvmlite
    import numba

require_tested_version("numba", numba.__version__)
require_tested_version("llvmlite", llvmlite.__version__)
