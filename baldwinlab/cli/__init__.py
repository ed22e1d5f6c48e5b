"""The command line. Only it knows both towers: the study that is run, and the report that is made of it."""

from __future__ import annotations

import sys

from baldwinlab import console
from baldwinlab.assays import command as assays  # noqa: F401  (each adds its commands)
from baldwinlab.cli import lab, measure, studies  # noqa: F401
from baldwinlab.cli.common import InterruptedStudyError, app
from baldwinlab.experiment import ExperimentError
from baldwinlab.movie import MovieError
from baldwinlab.multiverse import command as multiverse  # noqa: F401
from baldwinlab.studies.store import StudyError
from baldwinlab.sweeps import command as sweeps  # noqa: F401


def main() -> None:
    """Run the command line; every fault is one clear sentence and a non-zero exit."""
    try:
        app(sys.argv[1:])
    except (ExperimentError, StudyError, MovieError, ValueError) as error:
        console.complain(str(error))
        sys.exit(2)
    except InterruptedStudyError as error:
        console.complain(str(error))
        sys.exit(error.code)
    except KeyboardInterrupt:
        console.complain("stopped")
        sys.exit(130)
    except OSError as error:
        console.complain(f"{error.filename or ''}: {error.strerror}" if error.strerror else str(error))
        sys.exit(1)
