"""Test that Ctrl-C or SIGTERM stops the command line at any time without a traceback."""

from __future__ import annotations

import importlib
import os
import signal
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from types import FrameType

import pytest

import baldwinlab as bl
from baldwinlab.studies.progress import read_progress

# The command line is imported after the signals have their handlers.
START = """
import sys
from baldwinlab.__main__ import main


class Finder:
    @staticmethod
    def find_spec(name, path=None, target=None):
        if name == "baldwinlab.cli":
            sys.stderr.write("importing\\n")
            sys.stderr.flush()


sys.meta_path.insert(0, Finder)
main()
"""

# One long sleep would miss a signal that arrives just before it: Python handles signals between
# instructions, and the system call would not return.
SLEEP = """
while True:
    time.sleep(0.01)
"""

# The module is imported until a signal has arrived, and catches all errors.
SLOW_IMPORT = """
import baldwinlab.__main__ as command
try:
    while not command._is_waiting:
        time.sleep(0.01)
except BaseException:
    pass
"""

# `check` is called while the command validates its experiment.
SLOW_DESTRUCTOR = """
import sys, time
from baldwinlab.parts import Fitness


class Slow:
    def __del__(self):
        sys.stderr.write("deleting\\n")
        sys.stderr.flush()
        while True:
            time.sleep(0.01)


OBJECTS = [Slow()]


class Part(Fitness, name="slow"):
    def check(self, experiment):
        OBJECTS.clear()

    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = 1
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["ctrl-C", "SIGTERM"])
@pytest.mark.parametrize("state", ["importing", "simulating"])
def test_a_stopped_command_prints_one_line(
    tmp_path: Path, number: signal.Signals, state: str
) -> None:
    process = _start_command(tmp_path)
    while state == "simulating" and not list(read_progress(tmp_path / "study")):
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(number)
    _check_stopped(process)


def test_a_signal_stops_a_command_while_a_module_that_catches_all_errors_is_imported(
    tmp_path: Path,
) -> None:
    process = _start_command(tmp_path, SLOW_IMPORT)
    process.send_signal(signal.SIGTERM)
    _check_stopped(process)


def test_a_second_signal_stops_a_command_during_an_import(tmp_path: Path) -> None:
    process = _start_command(tmp_path, SLEEP)
    process.send_signal(signal.SIGTERM)
    # They are two interruptions in any order of their arrival.
    process.send_signal(signal.SIGINT)
    _check_stopped(process)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no timers")
def test_a_second_signal_during_the_handler_of_the_first_stops_an_import(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    main = importlib.import_module("baldwinlab.__main__")

    def receive_another_signal(frame: FrameType | None) -> bool:
        monkeypatch.setattr(main, "_is_importing", lambda frame: True)
        main._interrupt(signal.SIGINT, frame)
        return True

    monkeypatch.setattr(main, "_is_waiting", False)
    monkeypatch.setattr(main, "_start_timer", lambda: None)
    monkeypatch.setattr(main, "_is_importing", receive_another_signal)
    with pytest.raises(KeyboardInterrupt):
        main._interrupt(signal.SIGTERM, None)


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no timers")
def test_a_signal_during_a_destructor_stops_a_command(tmp_path: Path) -> None:
    part = tmp_path / "part.py"
    part.write_text(SLOW_DESTRUCTOR)
    words = ["--part", str(part), "--set", "evolution.fitness=slow"]
    process = _start_process([*_long_command(tmp_path), *words], "deleting")
    process.send_signal(signal.SIGTERM)
    _check_stopped(process)


# Compiled code of the hook does not return while the variable is set, and `check` runs the hook in
# plain Python if it is "python". A file tells the test that plain Python has begun.
ENDLESS_PART = """
import os
from pathlib import Path
from baldwinlab.parts import Fitness

IS_ENDLESS = os.environ.get("ENDLESS", "") != ""
IS_PRINTING = os.environ.get("ENDLESS") == "printing"
if os.environ.get("ENDLESS") == "python" and "NUMBA_DISABLE_JIT" in os.environ:
    Path("started").touch()
else:
    IS_ENDLESS = IS_ENDLESS and "NUMBA_DISABLE_JIT" not in os.environ


class Endless(Fitness, name="endless"):
    @staticmethod
    def evaluate(part, lifetimes, fitness):
        for agent in range(fitness.size):
            fitness[agent] = lifetimes.energy[agent]
        if IS_ENDLESS:
            print("running")
            while fitness[0] >= 0:
                fitness[0] = 1
                if IS_PRINTING:
                    print("running")
"""
ENDLESS_RUN = [
    *("run", "evo/A", "--runs", "1", "--part", "part.py", "--out", "study", "--set"),
    *("population.size=2", "lifetime.steps=20", "evolution.generations=2"),
    "evolution.fitness=endless",
]
BLOCKED = "baldwinlab: waiting for compiled code; press Ctrl-C again to end at once\n"

StartEndless = Callable[[list[str], str], subprocess.Popen[str]]


@pytest.fixture
def start_endless(tmp_path: Path) -> Iterator[StartEndless]:
    """Return a function that starts a command with an endless hook in a new process group."""
    (tmp_path / "part.py").write_text(ENDLESS_PART)
    with ExitStack() as processes:

        def start(words: list[str], endless: str) -> subprocess.Popen[str]:
            process = subprocess.Popen(
                [sys.executable, "-u", "-m", "baldwinlab", *words],
                cwd=tmp_path,
                env=os.environ | {"ENDLESS": endless},
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                start_new_session=True,
            )
            processes.callback(_kill_group, process.pid)
            return process

        yield start


def _kill_group(group: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)


def _wait_for_line(process: subprocess.Popen[str], start: str) -> None:
    assert process.stdout is not None
    # An endless hook may print without end.
    last_lines: deque[str] = deque(maxlen=20)
    for line in process.stdout:
        if line.startswith(start):
            return
        last_lines.append(line)
    pytest.fail(f"no line {start!r}: {list(last_lines)}")


def _has_processes(group: int) -> bool:
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no process groups")
@pytest.mark.parametrize(
    ("number", "endless"),
    [(signal.SIGINT, "compiled"), (signal.SIGTERM, "compiled"), (signal.SIGINT, "printing")],
)
def test_a_second_signal_ends_a_run_whose_hook_is_endless_and_the_study_resumes(
    tmp_path: Path,
    start_endless: StartEndless,
    number: signal.Signals,
    endless: str,
) -> None:
    # A `print` of compiled code swallows an interruption that arrives while it writes.
    process = start_endless(ENDLESS_RUN, endless)
    _wait_for_line(process, "running")
    process.send_signal(number)
    _wait_for_line(process, BLOCKED)
    assert process.poll() is None
    process.send_signal(number)
    out, _ = process.communicate()
    assert process.returncode == 130
    assert "Traceback" not in out
    assert not _has_processes(process.pid)
    resumed = start_endless(ENDLESS_RUN, "")
    out, _ = resumed.communicate()
    assert resumed.returncode == 0, out
    assert bl.open_study(tmp_path / "study").runs("evo/A") == [0]


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no process groups")
@pytest.mark.parametrize(
    ("number", "endless"),
    [(signal.SIGINT, "python"), (signal.SIGTERM, "python"), (signal.SIGINT, "compiled")],
)
def test_a_signal_ends_a_check_of_an_endless_hook_with_its_processes(
    tmp_path: Path,
    start_endless: StartEndless,
    number: signal.Signals,
    endless: str,
) -> None:
    process = start_endless(["check", "part.py"], endless)
    if endless == "python":
        while not (tmp_path / "started").exists():
            assert process.poll() is None
            time.sleep(0.01)
    else:
        # The next requirement compiles the hook and calls it.
        _wait_for_line(process, "ok: no output and no result depends on memory")
    process.send_signal(number)
    out, _ = process.communicate()
    assert process.returncode == 130, out
    assert "Traceback" not in out
    assert out.endswith("baldwinlab: Interrupted.\n")
    # The end of a child process may take a moment.
    while _has_processes(process.pid):
        time.sleep(0.01)


def _long_command(folder: Path) -> list[str]:
    return ["run", "evo/A", "--runs", "200", "--out", str(folder / "study"), "--workers", "1"]


def _start_command(folder: Path, slow: str = "") -> subprocess.Popen[str]:
    """Start a long command. A part imports a module with the code `slow`, if it is given."""
    words = _long_command(folder)
    if slow:
        (folder / "slow.py").write_text(
            f"import sys, time\nsys.stderr.write('loading\\n')\nsys.stderr.flush()\n{slow}\n"
        )
        (folder / "part.py").write_text(
            f"import sys, time\nsys.path.insert(0, {str(folder)!r})\nimport slow\n{SLEEP}"
        )
        words += ["--part", str(folder / "part.py")]
    return _start_process(words, *(["loading"] if slow else []))


def _start_process(words: list[str], *messages: str) -> subprocess.Popen[str]:
    """Start a command, and wait for its messages on standard error."""
    process = subprocess.Popen(
        [sys.executable, "-c", START, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stderr is not None
    for message in ("importing", *messages):
        assert process.stderr.readline() == f"{message}\n"
    return process


def _check_stopped(process: subprocess.Popen[str]) -> None:
    out, err = process.communicate()
    assert process.returncode == 130, err
    assert "Traceback" not in err + out
    assert "Interrupted" in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.parametrize("words", ["list presets", "list presets --json", "show evo/A", "--help"])
def test_a_command_whose_reader_has_ended_has_the_status_of_other_tools(words: str) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    done = subprocess.run(
        [sys.executable, "-m", "baldwinlab", *words.split()], stdout=writer, stderr=subprocess.PIPE
    )
    os.close(writer)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b"")


def test_a_command_without_any_stream_completes_its_study(tmp_path: Path) -> None:
    short = "evolution.generations=1 lifetime.steps=1"
    command = f"{sys.executable} -m baldwinlab run evo/A --runs 1 --set {short} --out study"
    done = subprocess.run(["sh", "-c", f"{command} <&- >&- 2>&-"], cwd=tmp_path)
    assert done.returncode == 0
    assert bl.open_study(tmp_path / "study").runs("evo/A") == [0]


def test_a_program_without_stdout_shows_no_progress() -> None:
    code = """
import sys
sys.stdout = None
from baldwinlab.core import console
with console.progress("simulating", 2) as report:
    report(2)
console.info("finished")
console.print_json({})
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True)
    assert (done.returncode, done.stderr) == (0, b"")


@pytest.mark.parametrize(
    ("variable", "message"),
    [
        ("NUMBA_NUM_THREADS=0", "NUMBA_NUM_THREADS is '0': Number of threads specified must be"),
        ("BALDWINLAB_LANES=0", "BALDWINLAB_LANES is '0' and must be a whole number from 1 to 64"),
        ("BALDWINLAB_LANES=x", "BALDWINLAB_LANES is 'x' and must be a whole number from 1 to 64"),
        ("BALDWINLAB_POISON=9", "BALDWINLAB_POISON is '9' and must be 0 (off), 1 or 2"),
    ],
)
def test_a_message_about_an_environment_variable_names_it(
    tmp_path: Path, variable: str, message: str
) -> None:
    command = [sys.executable, "-m", "baldwinlab", "run", "evo/A", "--runs", "1"]
    done = subprocess.run(["env", variable, *command], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.startswith(f"baldwinlab: the environment variable {message}")


@pytest.mark.parametrize("variable", ["COLUMNS=0", "MPLBACKEND=nonsense"])
def test_a_command_ignores_a_variable_that_it_cannot_use(variable: str) -> None:
    code = "from baldwinlab.__main__ import main; main(); import matplotlib"
    words = ["env", variable, sys.executable, "-c", code, "list", "papers"]
    done = subprocess.run(words, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "le-2019" in done.stdout
