"""A grammar of hostile folders: one or two changes of a valid study."""

from __future__ import annotations

import os
import random
import shutil
import socket
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

Random = random.Random

TEXTS = [
    "\x1b[31mred",
    "\x1b]0;title\x07",
    "\u202eabc",
    "a\nb",
    "",
    "x" * 5000,
    "é",
    "e\u0301",
    "$x^$",
]
NAMES = [
    "CON",
    "\x1b[2J",
    "a\u202eb",
    "é",
    "e\u0301",
    "x" * 200,
    " ",
    "-rf",
    "a\nb",
    "\udcff",
    "$(ls)",
]
RUN_NUMBERS = [
    "2147483640",
    "9999999999999",
    "-1",
    "0000-2147483640",
    "0005-0001",
    "1e3",
    "٣",
    "0" * 60,
]
VALUES = [
    "5",
    "-1",
    "1e999",
    "nan",
    "true",
    '"\\u001b[31m"',
    "[]",
    "{}",
    "[1, [2]]",
    '""',
    "9" * 400,
]
JSON_TEXTS = [
    "{",
    "[]",
    "5",
    "null",
    '{"a": 1}',
    "[" * 100_000,
    '{"pid": "x"}',
    "\x00",
    '"\x1b[2J"',
]
SPARSE_BYTES = 60 * 10**9


def choose_file(study: Path, choice: Random, suffix: str = "") -> Path:
    """Return a file of the study, which an earlier change has not enlarged."""
    files = [path for path in study.rglob(f"*{suffix}") if path.is_file()]
    return choice.choice(
        sorted(
            path for path in files if not path.is_symlink() and path.stat().st_size < SPARSE_BYTES
        )
    )


def replace_by_link(study: Path, choice: Random) -> str:
    path = choice.choice(sorted(p for p in study.rglob("*") if not p.is_symlink()))
    target = choice.choice(
        ["../neighbor", "../neighbor/runs", "nowhere", ".", path.name, "/dev/zero"]
    )
    if target.startswith("..") and choice.random() < 0.5:
        target = str(study.parent / "neighbor" / path.relative_to(study))
    remove(path)
    path.symlink_to(target)
    return f"{path.relative_to(study)} is a link to {Path(target).name}"


def replace_by_pipe(study: Path, choice: Random) -> str:
    path = choose_file(study, choice)
    path.unlink()
    os.mkfifo(path)
    return f"{path.relative_to(study)} is a FIFO"


def replace_by_socket(study: Path, choice: Random) -> str:
    path = choose_file(study, choice)
    path.unlink()
    here = Path.cwd()
    try:
        # The path of a socket has at most 107 bytes.
        os.chdir(path.parent)
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(path.name)
    finally:
        os.chdir(here)
    return f"{path.relative_to(study)} is a socket"


def replace_by_folder(study: Path, choice: Random) -> str:
    path = choose_file(study, choice)
    path.unlink()
    path.mkdir()
    return f"{path.relative_to(study)} is a folder"


def replace_by_file(study: Path, choice: Random) -> str:
    path = choice.choice(sorted(p for p in study.rglob("*") if p.is_dir()))
    remove(path)
    path.write_bytes(choice.choice([b"", b"x", b"\xff\xfe"]))
    return f"{path.relative_to(study)} is a file instead of a folder"


def enlarge(study: Path, choice: Random) -> str:
    path = choose_file(study, choice)
    os.truncate(path, SPARSE_BYTES)
    return f"{path.relative_to(study)} has 60 GB of zeros"


def empty_file(study: Path, choice: Random) -> str:
    path = choose_file(study, choice)
    path.write_bytes(b"")
    return f"{path.relative_to(study)} is empty"


def damage_bytes(study: Path, choice: Random) -> str:
    path = choose_file(study, choice)
    raw = bytearray(path.read_bytes() or b"0")
    for _ in range(choice.choice([1, 20])):
        raw[choice.randrange(len(raw))] = choice.randrange(256)
    path.write_bytes(raw)
    return f"{path.relative_to(study)} has changed bytes"


def change_value(study: Path, choice: Random) -> str:
    path = choose_file(study, choice, ".toml")
    lines = path.read_text("utf-8").split("\n")
    number = choice.choice([n for n, line in enumerate(lines) if " = " in line])
    key = lines[number].split(" = ")[0]
    lines[number] = f"{key} = {choice.choice(VALUES)}"
    path.write_text("\n".join(lines), "utf-8")
    return f"{path.relative_to(study)}: {lines[number][:60]!r}"


def add_key(study: Path, choice: Random) -> str:
    path = choose_file(study, choice, ".toml")
    key = choice.choice(TEXTS).encode("unicode_escape").decode().replace("\\x", "\\u00")
    deep = "a = " + "[" * 2000 + "]" * 2000
    line = choice.choice([f'"{key}" = 1', deep, "format = 99", "parts = 5", "[["])
    path.write_text(f"{line}\n" + path.read_text("utf-8"), "utf-8")
    return f"{path.relative_to(study)} begins with {line[:60]!r}"


def replace_json(study: Path, choice: Random) -> str:
    name = choice.choice(
        ["sessions.jsonl", ".running-1.json", "results.json", "claims.json", "baldwin.json"]
    )
    (study / name).write_text(choice.choice(JSON_TEXTS) + "\n", "utf-8")
    return f"{name} is {(study / name).read_text('utf-8')[:30]!r}"


def add_record(study: Path, choice: Random) -> str:
    record = choose_file(study, choice, ".nc")
    path = record.with_name(choice.choice(RUN_NUMBERS) + ".nc")
    path.write_bytes(choice.choice([b"x", record.read_bytes()]))
    return f"there is a record {path.relative_to(study)}"


def add_name(study: Path, choice: Random) -> str:
    folder = choice.choice(sorted(p for p in study.rglob("*") if p.is_dir()))
    name = choice.choice(NAMES)
    if choice.random() < 0.5:
        (folder / name).mkdir(exist_ok=True)
    else:
        (folder / (name + choice.choice([".nc", ".toml", ""]))).write_bytes(b"x")
    return f"{folder.relative_to(study)} has the name {name[:20]!r}"


def remove_something(study: Path, choice: Random) -> str:
    path = choice.choice(sorted(study.rglob("*")))
    remove(path)
    return f"{path.relative_to(study)} is missing"


def protect(study: Path, choice: Random) -> str:
    path = choice.choice(sorted(p for p in study.rglob("*") if not p.is_symlink()))
    path.chmod(choice.choice([0o000, 0o444, 0o555]))
    return f"{path.relative_to(study)} has the mode {path.stat().st_mode & 0o777:o}"


def remove(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink()


CHANGES: list[Callable[[Path, Random], str]] = [
    replace_by_link,
    replace_by_pipe,
    replace_by_socket,
    replace_by_folder,
    replace_by_file,
    enlarge,
    empty_file,
    damage_bytes,
    change_value,
    add_key,
    replace_json,
    add_record,
    add_name,
    remove_something,
    protect,
]


def make_hostile(study: Path, choice: Random) -> str:
    """Change a copy of a valid study once or twice. Return a description of the changes."""
    descriptions = [choice.choice(CHANGES)(study, choice)]
    if choice.random() < 0.3:
        # The first change can have removed the file of the second.
        with suppress(OSError, IndexError, UnicodeDecodeError):
            descriptions.append(choice.choice(CHANGES)(study, choice))
    return "; ".join(descriptions)
