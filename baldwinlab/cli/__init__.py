"""The command line. Each command has a module, which is imported when the command runs."""

from __future__ import annotations

import sys
import warnings
from contextlib import chdir
from pathlib import Path
from traceback import format_exception
from typing import Final

from cyclopts import CycloptsError, Group

from baldwinlab.cli.options import OVERVIEW, app, read_docstring
from baldwinlab.core import console
from baldwinlab.core.errors import ArgumentError, BaldwinLabError, InterruptedStudyError
from baldwinlab.core.third_party_code import raise_part_errors

# The arguments that the help of each command shows, by the groups of `baldwinlab --help`. The
# command "run" is the function `run` in the module `run`.
GROUPS: Final[dict[str, dict[str, str]]] = {
    "Run": {
        "reproduce": "[PAPER]",
        "run": "EXPERIMENT [EXPERIMENTS...]",
        "sweep": "FILE",
        "multiverse": "[PAPER]",
    },
    "Analyze": {
        "assay": "DIRECTORY",
        "report": "DIRECTORY",
        "status": "DIRECTORY",
    },
    "Look": {
        "lab": "[DIRECTORY]",
        "replay": "[DIRECTORY] [--run RUN --generation GENERATION] --out OUT",
        "export": "[SOURCE]",
        "freeze": "REFERENCE --out OUT",
    },
    "Parts and papers": {
        "list": "papers|presets|parts",
        "show": "EXPERIMENT",
        "check": "FILE",
    },
    "Machine": {
        "doctor": "[FOLDER]",
    },
}
COMMANDS: Final = [name for commands in GROUPS.values() for name in commands]
# Commands whose function has another name, because `list` would hide the function of Python.
FUNCTION_NAMES: Final = {"list": "list_names"}
# The exit statuses of the command line.
FAILURE_STATUS: Final = 1
USAGE_ERROR_STATUS: Final = 2
INTERRUPTED_STATUS: Final = 130


def _join_lines(paragraph: str) -> str:
    """Join the lines of a paragraph, but not the lines of an example, which are indented."""
    is_example = paragraph.startswith("    ")
    return paragraph if is_example else " ".join(paragraph.split())


def _register_commands() -> None:
    # The sort keys keep the order of `GROUPS` in the help.
    for group_number, (title, commands) in enumerate(GROUPS.items()):
        group = Group(title, sort_key=group_number)
        for command_number, (name, arguments) in enumerate(commands.items()):
            address = f"baldwinlab.cli.{name}:{FUNCTION_NAMES.get(name, name)}"
            app.command(
                address,
                name=name,
                help="\n\n".join(map(_join_lines, read_docstring(address).split("\n\n"))),
                group=group,
                sort_key=command_number,
                usage=f"Usage: baldwinlab {name} [OPTIONS] {arguments}",
            )


_register_commands()


def main() -> None:
    """Run the command line. An error prints one sentence and sets a non-zero exit status."""
    _ignore_local_matplotlibrc()
    warnings.showwarning = lambda message, *_: console.warn(str(message))
    sys.excepthook = lambda *error: console.errors.print("".join(format_exception(*error)))
    try:
        if len(sys.argv) == 1:
            console.info(OVERVIEW)
            return
        with console.own_stdout(), raise_part_errors(find_labels=_label_files):
            app(sys.argv[1:], exit_on_error=False)
    except CycloptsError:
        # The error is printed. The default status depends on the version of cyclopts.
        sys.exit(USAGE_ERROR_STATUS)
    except ArgumentError as error:
        # `error.option` names the option of the command, and `str(error)` the argument in Python.
        _fail(error.option, USAGE_ERROR_STATUS)
    except InterruptedStudyError as error:
        _fail(str(error), FAILURE_STATUS)
    except (BaldwinLabError, ValueError) as error:
        _fail(str(error), USAGE_ERROR_STATUS)
    except KeyboardInterrupt as error:
        _fail(str(error) or "Interrupted.", INTERRUPTED_STATUS)
    except OSError as error:
        has_file = error.filename and error.strerror
        reason = f"{error.filename}: {error.strerror}" if has_file else error.strerror
        _fail(reason or str(error), FAILURE_STATUS)
    finally:
        console.reserve_stdout(False)


def _label_files() -> dict[str, str]:
    # Imported late, because most commands end without an error of a part.
    from baldwinlab.experiment.registry import label_files

    return label_files()


def _ignore_local_matplotlibrc() -> None:
    """Ignore the settings file of Matplotlib in the working directory, if it exists."""
    if Path("matplotlibrc").exists():
        # Importing Matplotlib reads the file in the working directory, so it is imported elsewhere.
        with chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401


def _fail(message: str, status: int) -> None:
    console.warn(message)
    sys.exit(status)
