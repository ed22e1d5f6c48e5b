"""The command line: a thin layer over `baldwinlab.api`. A command's module is loaded when the command is used."""

from __future__ import annotations

import ast
import sys
import warnings
from contextlib import chdir
from pathlib import Path

from baldwinlab.cli.options import app
from baldwinlab.core import console
from baldwinlab.core.errors import ArgumentError, BaldwinLabError, InterruptedStudyError

COMMANDS = {  # module and function of each
    "assay": ("cli.assay", "assay"),
    "bench": ("cli.bench", "bench"),
    "check": ("cli.check", "check"),
    "claims": ("cli.claims", "claims"),
    "crate": ("cli.crate", "crate"),
    "doctor": ("cli.doctor", "doctor"),
    "export": ("cli.export", "export"),
    "gallery": ("cli.gallery", "gallery"),
    "lab": ("cli.lab", "lab"),
    "multiverse": ("cli.multiverse", "multiverse"),
    "papers": ("cli.papers", "papers"),
    "phylogeny": ("cli.phylogeny", "phylogeny"),
    "presets": ("cli.presets", "list_presets"),
    "replay": ("cli.replay", "replay"),
    "report": ("cli.report", "report"),
    "reproduce": ("cli.reproduce", "reproduce"),
    "run": ("cli.run", "run"),
    "show": ("cli.presets", "show"),
    "sweep": ("cli.sweep", "sweep"),
}


def _help(module: str, function: str) -> str:
    """A command's docstring, read without loading what the command uses, which takes seconds."""
    tree = ast.parse(
        (Path(__file__).parents[1] / f"{module.replace('.', '/')}.py").read_text("utf-8")
    )
    (found,) = (
        node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == function
    )
    return "\n\n".join(
        " ".join(paragraph.split()) for paragraph in (ast.get_docstring(found) or "").split("\n\n")
    )


for _name, (_module, _function) in COMMANDS.items():
    app.command(f"baldwinlab.{_module}:{_function}", name=_name, help=_help(_module, _function))


def main() -> None:
    """Run the command line; every fault is one clear sentence and a non-zero exit."""
    _pass_over_matplotlibrc()
    warnings.showwarning = lambda message, *_: console.warn(str(message))
    try:
        app(sys.argv[1:])
    except ArgumentError as error:
        _fail(error.option, 2)
    except InterruptedStudyError as error:
        _fail(str(error), 1)
    except (BaldwinLabError, ValueError) as error:
        _fail(str(error), 2)
    except KeyboardInterrupt as error:
        _fail(str(error) or "stopped", 130)
    except OSError as error:
        _fail(
            f"{error.filename}: {error.strerror}"
            if error.filename and error.strerror
            else error.strerror or str(error),
            1,
        )


def _pass_over_matplotlibrc() -> None:
    """Load Matplotlib from another folder where the working directory has settings that it would read."""
    if Path("matplotlibrc").exists():
        with chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401


def _fail(sentence: str, code: int) -> None:
    console.warn(sentence)
    sys.exit(code)
