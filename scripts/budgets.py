"""Print the size of the repository: `python -m scripts.budgets`."""

import subprocess
from pathlib import Path

from baldwinlab.cli import COMMANDS
from baldwinlab.engine.fingerprint import remove_comments


def list_files(*patterns: str) -> list[Path]:
    """Return the tracked files that match patterns of Git, without third-party files."""
    output = subprocess.check_output(["git", "ls-files", *patterns], text=True)
    paths = map(Path, output.splitlines())
    return [path for path in paths if path.is_file() and "vendor" not in path.parts]


def count(split: str, *patterns: str) -> int:
    """Return the number of lines or words of files: `split` is "splitlines" or "split"."""
    return sum(len(getattr(path.read_text("utf-8"), split)()) for path in list_files(*patterns))


PACKAGE = "baldwinlab/*.py"
# Lines with code are no docstrings, no comments and no blank lines.
CODE = [remove_comments(path.read_text("utf-8")) for path in list_files(PACKAGE)]
SIZES = {
    "Python of the package, lines": count("splitlines", PACKAGE),
    "Python of the package, lines with code": sum(len(code.splitlines()) for code in CODE),
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
