"""The engine: compilation with Numba. It refuses versions of Numba that it was not tested with."""

import llvmlite
import numba

from baldwinlab.engine.versions import require_tested_version

require_tested_version("numba", numba.__version__)
require_tested_version("llvmlite", llvmlite.__version__)
