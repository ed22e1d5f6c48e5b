"""Run the examples of the documentation, and write their outputs: `python -m scripts.outputs`.

The output of a block of code is the block `text` after it. The README, the tutorials, the how-to
pages and the page on sweeps show outputs. Arguments are pages, by default these. `--table` only
counts the blocks.
"""

from __future__ import annotations

import argparse
import io
import os
import re
import shlex
import sys
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final, NamedTuple
from unittest.mock import patch

from PIL import Image

from baldwinlab.experiment import registry

ROOT: Final = Path(__file__).parents[1]
PAGES: Final = [
    ROOT / "README.md",
    *sorted((ROOT / "docs").glob("tutorials/*.md")),
    *sorted((ROOT / "docs").glob("how-to/*.md")),
    ROOT / "docs" / "reference" / "sweeps.md",
]
# A block of code, and after it its output, or the reason why it is not run.
BLOCK: Final = re.compile(
    r"^```(?P<language>[^`\n]*)\n(?P<code>.*?)^```\n"
    r"(?:\n```text\n(?P<output>.*?)^```\n|\n(?P<reason>\*Not run: [^\n]+\*)\n)?",
    re.MULTILINE | re.DOTALL,
)
FILE_NAME: Final = re.compile(r"# ([\w./-]+\.(?:toml|py|sh|yaml))\n")
# A picture of a page that an example writes. Its title is the file in the folder of the example.
PICTURE: Final = re.compile(r'!\[[^]]*\]\((\S+) "(\S+)"\)')
PICTURE_WIDTH: Final = 1200
# Languages of code that only runs elsewhere.
FOREIGN_LANGUAGES: Final = ("bash", "html", "js", "nginx", "py")
# A longer output is cut.
MAX_LINES: Final = 20
COLUMNS: Final = 100
# Lines that state progress, which differs from run to run.
PROGRESS: Final = re.compile(r"Workers:|Engine |simulating:|reading:|drawing |measuring:|compiling")
# Values that differ between machines, dates or versions.
VOLATILE: Final = [
    re.compile(r"[\d.,]+ (?:million )?agent-steps(?:/s| per second)"),
    re.compile(r"(?<=about )[\d.]+ (?:s|min|h)\b"),
    re.compile(r"[\d,]+ bytes"),
    re.compile(r"\d+(?= more lines\))"),
    re.compile(r"\b[0-9a-f]{64}\b"),
]


class Block(NamedTuple):
    """A block of code, with the file name in its first line, and the output after the block."""

    language: str
    code: str
    file: str
    output: str | None
    reason: str | None

    @property
    def is_run(self) -> bool:
        """Return whether the block is a command or a program, and no file."""
        return self.language in ("console", "python") and not self.file


def read_blocks(page: Path) -> list[Block]:
    """Return the blocks of code of a page, in their order."""
    return [_as_block(match) for match in BLOCK.finditer(page.read_text("utf-8"))]


def _as_block(match: re.Match[str]) -> Block:
    name = FILE_NAME.match(match["code"])
    file = name[1] if name else ""
    return Block(match["language"], match["code"], file, match["output"], match["reason"])


def run_page(page: Path, folder: Path) -> list[str]:
    """Run the blocks of a page in an empty folder, and return the output of each block.

    The output of a block that is not run is empty. Raises AssertionError if a command fails.
    """
    (folder / "examples").symlink_to(ROOT / "examples")
    names: dict[str, Any] = {"__name__": "__main__"}
    with _prepared(folder):
        return [_run(block, names, page) for block in read_blocks(page)]


@contextmanager
def _prepared(folder: Path) -> Iterator[None]:
    """Work in a folder, with a fixed width of the terminal, and remove custom parts at the end."""
    before = registry.custom_parts()
    variables = {"MPLBACKEND": "agg", "COLUMNS": str(COLUMNS)}
    path = [str(folder), *sys.path]
    with chdir(folder), patch.dict(os.environ, variables), patch.object(sys, "path", path):
        yield
    for kind, name in registry.custom_parts().keys() - before.keys():
        registry.remove(kind, name)


def _run(block: Block, names: dict[str, Any], page: Path) -> str:
    if block.file:
        path = Path(block.file)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.code, "utf-8")
    elif block.language == "console":
        lines = block.code.replace("\\\n", " ").splitlines()
        return clean("".join(_run_command(line) for line in lines))
    elif block.language == "python":
        with redirect_stdout(io.StringIO()) as out:
            exec(compile(block.code, page.name, "exec"), names)
        return clean(out.getvalue())
    return ""


def _run_command(line: str) -> str:
    """Run a line of a console, and return what it prints. `> FILE` stores it instead."""
    from baldwinlab.cli import main

    command, _, target = line.partition(" > ")
    program, *arguments = shlex.split(command, comments=True)
    assert program == "baldwinlab", line
    out, err = io.StringIO(), io.StringIO()
    with (
        redirect_stdout(out),
        redirect_stderr(err),
        patch.object(sys, "argv", [program, *arguments]),
    ):
        try:
            main()
        except SystemExit as end:
            assert not end.code, (line, err.getvalue())
    if target:
        Path(target).write_text(out.getvalue(), "utf-8")
        return ""
    return out.getvalue()


def clean(output: str) -> str:
    """Return an output without progress and surplus space, and with at most `MAX_LINES` lines."""
    lines = [line.rstrip() for line in output.splitlines() if not PROGRESS.match(line)]
    # Of neighboring empty lines, one remains, and none at the start.
    lines = [line for line, earlier in zip(lines, ["", *lines], strict=False) if line or earlier]
    if len(lines) > MAX_LINES:
        surplus = len(lines) - MAX_LINES + 1
        lines = [*lines[: MAX_LINES - 1], f"... ({surplus} more lines)"]
    return "\n".join(lines).rstrip() + "\n" if lines else ""


def normalize(output: str) -> str:
    """Return an output with a placeholder for each value that differs between machines."""
    for pattern in VOLATILE:
        output = pattern.sub("N", output)
    return output


def insert_outputs(text: str, outputs: list[str]) -> str:
    """Return a page with the outputs of its blocks. An equal output keeps its volatile values."""
    remaining = iter(outputs)

    def replace(match: re.Match[str]) -> str:
        block, output = _as_block(match), next(remaining)
        if not block.is_run or normalize(block.output or "") == normalize(output):
            return match[0]
        code = f"```{block.language}\n{block.code}```\n"
        return f"{code}\n```text\n{output}```\n" if output else code

    return BLOCK.sub(replace, text)


def read_pictures(text: str) -> Iterator[tuple[str, str]]:
    """Yield the pictures that examples of a page write: their path, and the file of the example."""
    for match in PICTURE.finditer(text):
        yield match[1], match[2]


def draw_picture(file: Path) -> Image.Image:
    """Return a picture of an example in the size and the colors in which a page shows it."""
    with Image.open(file) as picture:
        smaller = picture.convert("RGB")
    smaller.thumbnail((PICTURE_WIDTH, PICTURE_WIDTH))
    return smaller.quantize(64)


def count_blocks(page: Path) -> Counter[str]:
    """Count the blocks of a page by what they show."""
    return Counter(_kind(block) for block in read_blocks(page))


def _kind(block: Block) -> str:
    if block.is_run:
        return "output" if block.output else "without"
    if block.reason:
        return "not run"
    return "without" if block.language in FOREIGN_LANGUAGES and not block.output else "file"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pages", type=Path, nargs="*", default=PAGES)
    parser.add_argument("--table", action="store_true", help="only count the blocks of each page")
    arguments = parser.parse_args()
    total: Counter[str] = Counter()
    print("page                                    output  not run  file  without  CPU s")
    for page in map(Path.resolve, arguments.pages):
        start = time.process_time()
        if not arguments.table:
            write_outputs(page)
        counts = count_blocks(page)
        total += counts
        _print_row(page.relative_to(ROOT).as_posix(), counts, time.process_time() - start)
    _print_row("all", total, time.process_time())


def _print_row(title: str, counts: Counter[str], seconds: float) -> None:
    columns = [counts[kind] for kind in ("output", "not run", "file", "without")]
    print("{:38}  {:6}  {:7}  {:4}  {:7}  {:5.1f}".format(title, *columns, seconds), flush=True)


def write_outputs(page: Path) -> None:
    """Run a page, and write its outputs and pictures."""
    text = page.read_text("utf-8")
    with TemporaryDirectory() as name:
        outputs = run_page(page, Path(name))
        for path, file in read_pictures(text):
            draw_picture(Path(name) / file).save(page.parent / path, optimize=True)
    page.write_text(insert_outputs(text, outputs), "utf-8")


if __name__ == "__main__":
    main()
