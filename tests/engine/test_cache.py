"""Test that only complete files in a private folder are loaded from the cache of compiled code."""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from baldwinlab.engine import cache, rng
from tests.engine.processes import run_python

DRAW = """
from baldwinlab.engine import rng
print(rng.words(1, 2, 3, 4, (1, 1)).ravel().tolist())
"""
WAITING_DRAW = f"""
import fcntl
lock = fcntl.flock
def report_and_lock(file, operation):
    print("waiting", flush=True)
    lock(file, operation)
fcntl.flock = report_and_lock
{DRAW}
"""
EXPECTED = f"{rng.words(1, 2, 3, 4, (1, 1)).ravel().tolist()}\n"

pytestmark = pytest.mark.skipif(
    not hasattr(os, "getuid"), reason="needs owners and modes of folders"
)


def draw(code: str = DRAW, **environment: str) -> subprocess.CompletedProcess[str]:
    return run_python(code, environment=environment, check=False)


def stored_files(folder: Path) -> list[Path]:
    return sorted(folder.rglob(f"*{cache.CODE_SUFFIX}"))


@pytest.fixture(scope="module")
def compiled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a cache folder with the code of `DRAW`, which tests copy."""
    folder = tmp_path_factory.mktemp("cache") / "compiled"
    assert draw(BALDWINLAB_CACHE=str(folder)).stdout == EXPECTED
    return folder


@pytest.fixture
def folder(compiled: Path, tmp_path: Path) -> Path:
    """Return a copy of the cache folder."""
    return shutil.copytree(compiled, tmp_path / "shared" / "cache")


def test_the_cache_folder_is_private(tmp_path: Path) -> None:
    assert draw(BALDWINLAB_CACHE=str(tmp_path / "mine")).stdout == EXPECTED
    assert stored_files(tmp_path / "mine")
    assert (tmp_path / "mine").stat().st_mode & 0o022 == 0


def test_a_private_temporary_folder_replaces_an_unusable_cache_folder(
    tmp_path: Path,
) -> None:
    (tmp_path / "a file, not a folder").write_text("")
    done = draw(
        BALDWINLAB_CACHE="",
        XDG_CACHE_HOME=str(tmp_path / "a file, not a folder"),
        TMPDIR=str(tmp_path),
    )
    assert done.stdout == EXPECTED
    assert done.stderr == ""
    assert len(list(tmp_path.glob("baldwinlab-*"))) == 1
    assert stored_files(tmp_path)


def test_an_unusable_given_folder_is_reported_and_not_replaced(
    tmp_path: Path,
) -> None:
    (tmp_path / "a file, not a folder").write_text("")
    done = draw(BALDWINLAB_CACHE=str(tmp_path / "a file, not a folder"), TMPDIR=str(tmp_path))
    assert done.stdout == EXPECTED
    assert "compiled code is not cached: " in done.stderr
    assert not stored_files(tmp_path)


@pytest.mark.parametrize("permission", ["write", "own", "replace"])
def test_a_folder_that_other_users_can_change_is_reported_and_not_used(
    permission: str, folder: Path
) -> None:
    before = [file.stat() for file in stored_files(folder)]
    if permission == "write":
        folder.chmod(0o777)
    elif permission == "own":
        if os.getuid():
            pytest.skip("only root can give a folder away")
        os.chown(folder, 12345, -1)
    else:
        folder.parent.chmod(0o777)
    done = draw(BALDWINLAB_CACHE=str(folder))
    assert done.stdout == EXPECTED
    assert "compiled code is not cached" in done.stderr
    assert str(folder) in done.stderr
    after = [file.stat() for file in stored_files(folder)]
    assert [status.st_mtime for status in after] == [status.st_mtime for status in before]
    assert [status.st_ino for status in after] == [status.st_ino for status in before]
    assert [status.st_atime for status in after] == [status.st_atime for status in before]


@pytest.mark.parametrize(
    "damage",
    [
        *("a bit flipped", "a pickle that runs"),
        *(
            pytest.param(damage, marks=pytest.mark.nightly)
            for damage in ("cut short", "emptied", "another file's")
        ),
    ],
)
def test_damaged_code_is_compiled_again(damage: str, folder: Path) -> None:
    (file,) = stored_files(folder)
    content = file.read_bytes()
    middle = len(content) // 2
    file.write_bytes(
        {
            "cut short": content[:middle],
            "emptied": b"",
            "a bit flipped": content[:middle]
            + bytes([content[middle] ^ 16])
            + content[middle + 1 :],
            "another file's": content[cache.DIGEST_BYTES :],
            "a pickle that runs": content[: cache.DIGEST_BYTES] + b"cbuiltins\nexit\n(tR.",
        }[damage]
    )
    done = draw(BALDWINLAB_CACHE=str(folder))
    assert (done.stdout, done.stderr, done.returncode) == (EXPECTED, "", 0)
    assert len(file.read_bytes()) == pytest.approx(len(content), rel=0.01)


def test_garbage_with_a_matching_digest_is_compiled_again(folder: Path) -> None:
    (file,) = stored_files(folder)
    content = file.read_bytes()
    for garbage in (b"nothing of the kind", pickle.dumps([1, 2])):
        cache.FileCodeStore(file.parent).write(file.stem, garbage)
        assert file.read_bytes() != content
        done = draw(BALDWINLAB_CACHE=str(folder))
        assert (done.stdout, done.stderr, done.returncode) == (EXPECTED, "", 0)
        assert len(file.read_bytes()) == pytest.approx(len(content), rel=0.01)


DRAW_BOTH = f"{DRAW}print(rng.uniforms(1, 2, 3, 4, (1, 1)).ravel().tolist())\n"


def test_exchanged_files_of_compiled_code_are_compiled_again(tmp_path: Path) -> None:
    valid = draw(DRAW_BOTH, BALDWINLAB_CACHE=str(tmp_path))
    files = stored_files(tmp_path)
    first, second = (file.read_bytes() for file in files)
    files[0].write_bytes(second)
    files[1].write_bytes(first)
    done = draw(DRAW_BOTH, BALDWINLAB_CACHE=str(tmp_path))
    assert (done.stdout, done.stderr, done.returncode) == (valid.stdout, "", 0)
    sizes = [len(file.read_bytes()) for file in files]
    assert sizes == pytest.approx([len(first), len(second)], rel=0.01)


def test_valid_code_is_loaded(folder: Path) -> None:
    (file,) = stored_files(folder)
    inode = file.stat().st_ino
    assert draw(BALDWINLAB_CACHE=str(folder)).stdout == EXPECTED
    assert file.stat().st_ino == inode


def test_a_computation_continues_when_the_disk_is_full(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse_to_write(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    class Compiled:
        codegen = type("Codegen", (), {"magic_tuple": staticmethod(lambda: ("machine",))})

        def _reduce(self) -> tuple[int, ...]:
            return (1, 2, 3)

    monkeypatch.setattr(cache, "write_atomically", refuse_to_write)
    message = f"{tmp_path}: No space left on device"
    with pytest.warns(RuntimeWarning, match=message) as warnings:
        for code in ("first", "second"):
            cache.FileCodeStore(tmp_path / code).save_overload("(int64,)", Compiled())
    assert len(warnings) == 1


def test_a_process_waits_for_code_that_another_process_compiles(folder: Path) -> None:
    environment = {"BALDWINLAB_CACHE": str(folder)}
    (file,) = stored_files(folder)
    content = file.read_bytes()
    file.unlink()
    with cache.lock_directory(file.parent):
        waiting = subprocess.Popen(
            [sys.executable, "-c", WAITING_DRAW],
            env=os.environ | environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        assert waiting.stdout is not None
        assert waiting.stdout.readline() == "waiting\n"
        file.write_bytes(content)
    inode = file.stat().st_ino
    assert waiting.communicate()[0] == EXPECTED
    assert file.stat().st_ino == inode


@pytest.mark.nightly
def test_code_for_each_block_size_has_its_own_folder(tmp_path: Path) -> None:
    for lanes in ("4", "16"):
        assert draw(BALDWINLAB_CACHE=str(tmp_path), BALDWINLAB_LANES=lanes).stdout == EXPECTED
    assert len(list(tmp_path.glob("engine-*"))) == 2
