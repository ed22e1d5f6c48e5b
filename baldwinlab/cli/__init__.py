"""The command line. Each command has a module, which is imported when the command runs."""

from __future__ import annotations

import ast
import sys
import warnings
from contextlib import chdir
from pathlib import Path
from typing import Final, NamedTuple

from cyclopts import Group

from baldwinlab.cli.options import OVERVIEW, app
from baldwinlab.core import console
from baldwinlab.core.errors import ArgumentError, BaldwinLabError, InterruptedStudyError


class Command(NamedTuple):
    """The module and the function of a command, and the arguments in its help."""

    module: str
    function: str
    arguments: str = ""


# The commands, by the groups of `baldwinlab --help`.
GROUPS: Final[dict[str, dict[str, Command]]] = {
    "Run": {
        "reproduce": Command("cli.reproduce", "reproduce", "[PAPER]"),
        "run": Command("cli.run", "run", "EXPERIMENT [EXPERIMENTS...]"),
        "sweep": Command("cli.sweep", "sweep", "FILE"),
        "multiverse": Command("cli.multiverse", "multiverse", "[PAPER]"),
    },
    "Analyze": {
        "assay": Command("cli.assay", "assay", "DIRECTORY"),
        "report": Command("cli.report", "report", "DIRECTORY"),
        "status": Command("cli.status", "status", "DIRECTORY"),
    },
    "Look": {
        "lab": Command("cli.lab", "lab", "[DIRECTORY]"),
        "replay": Command(
            "cli.replay", "replay", "[DIRECTORY] [--run RUN --generation GENERATION] --out OUT"
        ),
        "export": Command("cli.export", "export", "[SOURCE]"),
        "freeze": Command("cli.freeze", "freeze", "REFERENCE --out OUT"),
    },
    "Parts and papers": {
        "list": Command("cli.list", "list_names", "papers|presets|parts"),
        "show": Command("cli.show", "show", "EXPERIMENT"),
        "check": Command("cli.check", "check", "FILE"),
    },
    "Machine": {
        "doctor": Command("cli.doctor", "doctor", "[FOLDER]"),
    },
}
COMMANDS: Final[dict[str, Command]] = {
    name: command
    for commands_of_group in GROUPS.values()
    for name, command in commands_of_group.items()
}
# The exit statuses of the command line.
FAILURE_STATUS: Final = 1
USAGE_ERROR_STATUS: Final = 2
INTERRUPTED_STATUS: Final = 130


def _read_docstring(module: str, function: str) -> str:
    """Return the docstring of a command. Read it from the file: an import takes seconds."""
    path = Path(__file__).parents[1] / f"{module.replace('.', '/')}.py"
    tree = ast.parse(path.read_text("utf-8"))
    definitions = (node for node in tree.body if isinstance(node, ast.FunctionDef))
    definition = next(node for node in definitions if node.name == function)
    paragraphs = (ast.get_docstring(definition) or "").split("\n\n")
    return "\n\n".join(map(_join_lines, paragraphs))


def _join_lines(paragraph: str) -> str:
    """Join the lines of a paragraph. The lines of an example, which is indented, stay separate."""
    is_example = paragraph.startswith("    ")
    return paragraph if is_example else " ".join(paragraph.split())


def _register_commands() -> None:
    # The sort keys keep the order of `GROUPS` in the help.
    for group_number, (title, commands) in enumerate(GROUPS.items()):
        group = Group(title, sort_key=group_number)
        for command_number, (name, command) in enumerate(commands.items()):
            usage = f"Usage: baldwinlab {name} [OPTIONS] {command.arguments}".rstrip()
            app.command(
                f"baldwinlab.{command.module}:{command.function}",
                name=name,
                help=_read_docstring(command.module, command.function),
                group=group,
                sort_key=command_number,
                usage=usage,
            )


_register_commands()


def main() -> None:
    """Run the command line. An error prints one sentence and sets a non-zero exit status."""
    _ignore_local_matplotlibrc()
    warnings.showwarning = lambda message, *_: console.warn(str(message))
    try:
        if len(sys.argv) == 1:
            console.info(OVERVIEW)
            return
        app(sys.argv[1:])
    except ArgumentError as error:
        # The attribute is a sentence about an option, the text one about a Python argument.
        _fail(error.option, USAGE_ERROR_STATUS)
    except InterruptedStudyError as error:
        _fail(str(error), FAILURE_STATUS)
    except (BaldwinLabError, ValueError) as error:
        _fail(str(error), USAGE_ERROR_STATUS)
    except KeyboardInterrupt as error:
        _fail(str(error) or "Interrupted.", INTERRUPTED_STATUS)
    except OSError as error:
        _fail(_describe_os_error(error), FAILURE_STATUS)
    finally:
        console.reserve_stdout(False)


def _describe_os_error(error: OSError) -> str:
    if error.filename and error.strerror:
        return f"{error.filename}: {error.strerror}"
    return error.strerror or str(error)


def _ignore_local_matplotlibrc() -> None:
    """Ignore the settings file of Matplotlib in the working directory, if it exists."""
    if Path("matplotlibrc").exists():
        # Matplotlib reads the settings file of the working directory when it is imported.
        with chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401


def _fail(message: str, status: int) -> None:
    console.warn(message)
    sys.exit(status)
