"""What must be true after every command, whatever the folder or the part contains."""

from __future__ import annotations

import hashlib
import json
import os
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from tests.faults.strangers.warm_process import HANGS

# Success, failure, usage error, interruption.
STATUSES = {"0", "1", "2", "130"}
LINES_OF_MESSAGE = 12
# `make faults` takes a new seed, and prints it.
FIRST_SEED = int(os.environ.get("STRANGERS_SEED", "0"))
ALLOWED_CONTROLS = "\n\t\r"
# Marks that change the direction of a text.
DIRECTIONAL_MARKS = {chr(code) for code in (*range(0x202A, 0x202F), *range(0x2066, 0x206A))}


class Outcome(NamedTuple):
    arguments: list[str]
    status: str
    out: str
    err: str

    def describe(self) -> str:
        """Return the command and the last lines of its output."""
        lines = (self.out + self.err).splitlines()[-LINES_OF_MESSAGE:]
        command = " ".join(["baldwinlab", *self.arguments])
        return f"{command!r} ended with {self.status}:\n" + ascii("\n".join(lines)[-1500:])


class WarmProcess:
    """A process that executes commands in `folder`, whose subfolder `work` has the files."""

    def __init__(self, process: subprocess.Popen[str], folder: Path) -> None:
        self.process = process
        self.folder = folder

    def run(self, *arguments: str) -> Outcome:
        """Execute a command of the command line."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write(
            json.dumps({"arguments": arguments, "folder": str(self.folder)}) + "\n"
        )
        self.process.stdin.flush()
        status = self.process.stdout.readline().strip()
        out, err = (
            Path(self.folder, "output", name).read_bytes().decode("utf-8", "backslashreplace")
            for name in ("out", "err")
        )
        return Outcome(list(arguments), status, out, err)


@contextmanager
def start_warm_process(folder: Path, **environment: str) -> Iterator[WarmProcess]:
    for name in ("output", "work"):
        (folder / name).mkdir(parents=True)
    command = [sys.executable, "-m", "tests.faults.strangers.warm_process"]
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "COLUMNS": "100", **environment},
    ) as process:
        try:
            yield WarmProcess(process, folder)
        finally:
            process.kill()


def find_faults(outcome: Outcome) -> list[str]:
    """Return what is wrong with the status and the output of a command."""
    faults = []
    if outcome.status == HANGS:
        faults.append("it hangs")
    elif outcome.status not in STATUSES:
        faults.append(f"status {outcome.status}")
    elif outcome.status != "0" and not (outcome.out + outcome.err).strip():
        faults.append("no message")
    if "Traceback (most recent call last)" in outcome.out + outcome.err:
        faults.append("a traceback")
    marks = sorted({mark for mark in outcome.out + outcome.err if is_control(mark)})
    if marks:
        faults.append(f"control characters {marks}")
    if outcome.status == "0" and ("--json" in outcome.arguments or outcome.arguments[0] == "lab"):
        try:
            json.loads(outcome.out)
        except ValueError as error:
            faults.append(f"no JSON: {error}")
    return faults


def is_control(mark: str) -> bool:
    is_escape = ord(mark) < 32 and mark not in ALLOWED_CONTROLS
    return is_escape or 0x7F <= ord(mark) < 0xA0 or mark in DIRECTIONAL_MARKS


def hash_files(root: Path, *left_out: str) -> dict[str, str]:
    """Return a hash of each regular file, and the kind and target of everything else.

    `left_out` has names of subfolders of `root`.
    """
    hashes = {}
    for folder, subfolders, names in os.walk(root):
        if Path(folder) == root:
            subfolders[:] = [name for name in subfolders if name not in left_out]
        for name in [*subfolders, *names]:
            path = Path(folder, name)
            key = os.fsencode(path.relative_to(root)).decode("utf-8", "backslashreplace")
            status = path.lstat()
            if stat.S_ISLNK(status.st_mode):
                hashes[key] = f"link to {path.readlink()!s}"
            elif not stat.S_ISREG(status.st_mode):
                hashes[key] = f"kind {stat.S_IFMT(status.st_mode)}"
            elif status.st_size > 2**24:
                hashes[key] = f"{status.st_size} bytes"
            else:
                hashes[key] = hashlib.sha256(path.read_bytes()).hexdigest()
    return hashes


def find_losses(before: dict[str, str], after: dict[str, str], outcome: Outcome) -> list[str]:
    """Return the records that a command has changed or removed without naming them."""
    text = outcome.out + outcome.err
    return [
        f"{name} is changed or lost"
        for name, hash in before.items()
        if after.get(name) != hash and name.endswith(".nc") and Path(name).name not in text
    ]
