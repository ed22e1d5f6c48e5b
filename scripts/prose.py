"""Report words that the repository does not use: `python -m scripts.prose [PATH ...]`.

The words, with their replacements, are in `docs/development/retired-words.toml`.
"""

import ast
import io
import re
import subprocess
import sys
import tokenize
import tomllib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

WORDS = Path("docs/development/retired-words.toml")
RULES = tomllib.loads(WORDS.read_text(encoding="utf-8"))
PROSE = {
    re.compile(rf"(?<![\w-])(?:{pattern})(?![\w-])".replace(" ", r"\s+"), re.IGNORECASE): plain
    for pattern, plain in RULES["prose"].items()
}
ALLOWED = "|".join(map(re.escape, RULES["allowed"])).replace(r"\ ", r"\s+")
CODE = r"`[^`]*`|https?://\S+"
# Text that is not prose, by the suffix of a file. Spaces replace it, so that line numbers stay.
NOT_PROSE = {
    ".py": CODE,
    ".md": rf"```.*?```|``.*?``|{CODE}|\]\([^)]*\)|<[^>]*>|\$[^$\n]+\$",
    ".toml": rf"^\s*[\w.\"'-]+\s*=|^\[.*?\]$|{CODE}",
    ".html": r"<(script|style)\b.*?</\1>|\{[{%#].*?[#%}]\}|</?[\w-]+|https?://\S+"
    r"|\s(?!title|alt|aria-label|placeholder)[\w-]+=\"[^\"]*\"",
    ".js": "https?://",
    ".sh": CODE,
    "": CODE,
}
JS_TEXT = re.compile(r"//[^\n]*|/\*.*?\*/|`[^`]*`|\"[^\"\n]*\"|'[^'\n]*'", re.DOTALL)
JS_NAME = re.compile(r"\b(?:function|class|const|let|var)\s+(\w+)")
# Files of an earlier version, whose content must not change.
STORED = ":!tests/studies/stored_0_1"
Finding = tuple[int, str, str]  # line, word, replacement


def check_prose(text: str, first_line: int, suffix: str) -> Iterator[Finding]:
    """Yield the retired words in a piece of prose."""
    for pattern in (NOT_PROSE[suffix], ALLOWED):
        blank = re.compile(pattern, re.DOTALL | re.MULTILINE)
        text = blank.sub(lambda match: re.sub(r"[^\n]", "\u00a0", match[0]), text)
    for retired, plain in PROSE.items():
        for match in retired.finditer(text):
            yield first_line + text.count("\n", 0, match.start()), " ".join(match[0].split()), plain


def check_name(name: str, line: int) -> Iterator[Finding]:
    """Yield a name that is retired, or that contains a retired word."""
    bare = name.strip("_")
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", bare).lower().split("_")
    plain = [RULES["words_of_names"][word] for word in words if word in RULES["words_of_names"]]
    if bare in RULES["names"] or plain:
        yield line, name, RULES["names"].get(bare) or plain[0]


def check_python(source: str) -> Iterator[Finding]:
    """Yield the retired words in the names, strings and comments of Python code."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and " " in str(node.value):
            yield from check_prose(str(node.value), node.lineno, ".py")
        elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
            yield from check_name(node.name, node.lineno)
        elif isinstance(node, ast.arg):
            yield from check_name(node.arg, node.lineno)
        elif isinstance(node, (ast.Name, ast.Attribute)) and isinstance(node.ctx, ast.Store):
            yield from check_name(getattr(node, "id", getattr(node, "attr", "")), node.lineno)
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield from check_prose(token.string.lstrip("# "), token.start[0], ".py")


def check_file(path: Path) -> Iterator[Finding]:
    """Yield the retired words in a file."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        yield from check_python(text)
    elif path.suffix == ".js":
        for match in JS_NAME.finditer(text):
            yield from check_name(match[1], 1 + text.count("\n", 0, match.start()))
        for match in JS_TEXT.finditer(text):
            yield from check_prose(match[0], 1 + text.count("\n", 0, match.start()), ".js")
    else:
        yield from check_prose(text, 1, path.suffix)


def main(paths: list[str]) -> int:
    """Print the retired words in the files of a Git work tree, and their number per folder."""
    options = ["--cached", "--others", "--exclude-standard"]
    command = ["git", "ls-files", *options, "--", STORED, *paths]
    names = subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()
    counts: Counter[str] = Counter()
    for path in map(Path, names):
        is_excluded = path == WORDS or "vendor" in path.parts
        if path.suffix in NOT_PROSE and path.is_file() and not is_excluded:
            for line, word, plain in sorted(set(check_file(path))):
                print(f"{path}:{line}: {word} -> {plain}")
                counts["/".join(path.parts[:-1][:2]) or "."] += 1
    for folder, count in counts.most_common():
        print(f"{count:6} {folder}", file=sys.stderr)
    return bool(counts)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
