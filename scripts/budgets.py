"""Print the size of the repository: `python -m scripts.budgets`."""

import subprocess
import tokenize
from itertools import pairwise
from pathlib import Path

from baldwinlab.cli import COMMANDS

LAYOUT = {tokenize.COMMENT, tokenize.NL, tokenize.INDENT, tokenize.DEDENT, tokenize.ENDMARKER}


def list_files(*patterns: str) -> list[Path]:
    """Return the tracked files that match patterns of Git, without third-party files."""
    output = subprocess.check_output(["git", "ls-files", *patterns], text=True)
    paths = map(Path, output.splitlines())
    return [path for path in paths if path.is_file() and "vendor" not in path.parts]


def count(split: str, *patterns: str) -> int:
    """Return the number of lines or words of files: `split` is "splitlines" or "split"."""
    return sum(len(getattr(path.read_text("utf-8"), split)()) for path in list_files(*patterns))


def count_code(path: Path) -> int:
    """Return the number of lines with code: no docstrings, no comments, no blank lines."""
    lines: set[int] = set()
    with path.open("rb") as file:
        tokens = [token for token in tokenize.tokenize(file.readline) if token.type not in LAYOUT]
    for before, token in pairwise(tokens):
        starts_line = before.type in (tokenize.ENCODING, tokenize.NEWLINE)
        if token.type != tokenize.NEWLINE and not (starts_line and token.type == tokenize.STRING):
            lines.update(range(token.start[0], token.end[0] + 1))
    return len(lines)


PACKAGE = "baldwinlab/*.py"
SIZES = {
    "Python of the package, lines": count("splitlines", PACKAGE),
    "Python of the package, lines with code": sum(map(count_code, list_files(PACKAGE))),
    "JavaScript, lines": count("splitlines", "baldwinlab/*.js"),
    "CSS, lines": count("splitlines", "baldwinlab/*.css"),
    "tests, lines": count("splitlines", "tests/*.py"),
    "scripts, lines": count("splitlines", "scripts"),
    "benchmarks, lines": count("splitlines", "benchmarks/*.py"),
    "documentation, words": count("split", "docs/*.md"),
    "commands": len(COMMANDS),
}

if __name__ == "__main__":
    for name, size in SIZES.items():
        print(f"{name:40}{size:8,}")
