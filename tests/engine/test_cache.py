"""What lies in the cache of compiled code is believed only where nobody else may have put it there, and where it is whole."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import baldwinlab
from baldwinlab.engine import cache, rng

DRAW = """
from baldwinlab.engine import rng
print(rng.words(1, 2, 3, 4, (1, 1)).ravel().tolist())
"""
EXPECTED = f"{rng.words(1, 2, 3, 4, (1, 1)).ravel().tolist()}\n"

pytestmark = pytest.mark.skipif(
    not hasattr(os, "getuid"), reason="about owners and modes of folders"
)


def draw(code: str = DRAW, **environment: str) -> subprocess.CompletedProcess[str]:
    root = Path(baldwinlab.__file__).parents[1]
    whole = {**os.environ, "PYTHONPATH": str(root), **environment}
    return subprocess.run(
        [sys.executable, "-c", code],
        env=whole,
        cwd=root,
        capture_output=True,
        text=True,
        check=False,
    )


def stored_files(folder: Path) -> list[Path]:
    return sorted(folder.rglob(f"*{cache.ENDING}"))


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


@pytest.mark.parametrize("others", ["may write", "own it", "may put another in its place"])
def test_a_folder_that_other_users_can_write_to_is_reported_and_not_used(
    others: str, tmp_path: Path
) -> None:
    shared = tmp_path / "shared"
    folder = shared / "cache"
    folder.mkdir(parents=True)
    assert draw(BALDWINLAB_CACHE=str(folder)).stdout == EXPECTED
    before = [file.stat() for file in stored_files(folder)]
    if others == "may write":
        folder.chmod(0o777)
    elif others == "own it":
        if os.getuid():
            pytest.skip("only root can give a folder away")
        os.chown(folder, 12345, -1)
    else:
        shared.chmod(0o777)
    done = draw(BALDWINLAB_CACHE=str(folder))
    assert done.stdout == EXPECTED
    assert "compiled code is not cached" in done.stderr
    assert str(folder) in done.stderr
    now = [file.stat() for file in stored_files(folder)]
    assert [(each.st_mtime, each.st_ino) for each in now] == [
        (each.st_mtime, each.st_ino) for each in before
    ]
    assert [each.st_atime for each in now] == [each.st_atime for each in before]


@pytest.mark.parametrize(
    "damage", ["cut short", "emptied", "a bit flipped", "another file's", "a pickle that runs"]
)
def test_damaged_code_is_compiled_again(damage: str, tmp_path: Path) -> None:
    assert draw(BALDWINLAB_CACHE=str(tmp_path)).stdout == EXPECTED
    (file,) = stored_files(tmp_path)
    whole = file.read_bytes()
    middle = len(whole) // 2
    file.write_bytes(
        {
            "cut short": whole[:middle],
            "emptied": b"",
            "a bit flipped": whole[:middle] + bytes([whole[middle] ^ 16]) + whole[middle + 1 :],
            "another file's": whole[cache.DIGEST :],
            "a pickle that runs": whole[: cache.DIGEST] + b"cbuiltins\nexit\n(tR.",
        }[damage]
    )
    done = draw(BALDWINLAB_CACHE=str(tmp_path))
    assert (done.stdout, done.stderr, done.returncode) == (EXPECTED, "", 0)
    assert len(file.read_bytes()) == pytest.approx(len(whole), rel=0.01)


def test_garbage_with_a_matching_digest_is_compiled_again(tmp_path: Path) -> None:
    draw(BALDWINLAB_CACHE=str(tmp_path))
    (file,) = stored_files(tmp_path)
    whole = file.read_bytes()
    for garbage in (b"nothing of the kind", pickle.dumps([1, 2])):
        cache.FileCodeStore(file.parent).write(file.stem, garbage)
        assert file.read_bytes() != whole
        done = draw(BALDWINLAB_CACHE=str(tmp_path))
        assert (done.stdout, done.stderr, done.returncode) == (EXPECTED, "", 0)
        assert len(file.read_bytes()) == pytest.approx(len(whole), rel=0.01)


DRAW_BOTH = f"{DRAW}print(rng.uniforms(1, 2, 3, 4, (1, 1)).ravel().tolist())\n"


def test_exchanged_files_of_compiled_code_are_compiled_again(tmp_path: Path) -> None:
    sound = draw(DRAW_BOTH, BALDWINLAB_CACHE=str(tmp_path))
    one, other = stored_files(tmp_path)
    first, second = one.read_bytes(), other.read_bytes()
    one.write_bytes(second)
    other.write_bytes(first)
    done = draw(DRAW_BOTH, BALDWINLAB_CACHE=str(tmp_path))
    assert (done.stdout, done.stderr, done.returncode) == (sound.stdout, "", 0)
    assert (len(one.read_bytes()), len(other.read_bytes())) == pytest.approx(
        (len(first), len(second)), rel=0.01
    )


def test_valid_code_is_loaded(tmp_path: Path) -> None:
    draw(BALDWINLAB_CACHE=str(tmp_path))
    (file,) = stored_files(tmp_path)
    before = file.stat().st_ino
    assert draw(BALDWINLAB_CACHE=str(tmp_path)).stdout == EXPECTED
    assert file.stat().st_ino == before


def test_a_full_disk_stops_no_computation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    class Compiled:
        codegen = type("Codegen", (), {"magic_tuple": staticmethod(lambda: ("here",))})

        def _reduce(self) -> tuple[int, ...]:
            return (1, 2, 3)

    monkeypatch.setattr(cache, "write_atomically", full)
    with pytest.warns(RuntimeWarning, match=f"{tmp_path}: No space left on device") as said:
        for code in ("one", "other"):
            cache.FileCodeStore(tmp_path / code).save_overload("(int64,)", Compiled())
    assert len(said) == 1


def test_a_process_waits_for_code_that_another_process_compiles(tmp_path: Path) -> None:
    environment = {"BALDWINLAB_CACHE": str(tmp_path)}
    draw(**environment)
    (made,) = stored_files(tmp_path)
    content = made.read_bytes()
    made.unlink()
    with cache.lock_directory(made.parent):
        waiting = subprocess.Popen(
            [sys.executable, "-c", DRAW],
            env=os.environ | environment,
            stdout=subprocess.PIPE,
            text=True,
        )
        with pytest.raises(subprocess.TimeoutExpired):
            waiting.communicate(timeout=5)
        made.write_bytes(content)
    put_there = made.stat().st_ino
    assert waiting.communicate(timeout=60)[0] == EXPECTED
    assert made.stat().st_ino == put_there


def test_code_for_blocks_of_another_size_has_another_folder(tmp_path: Path) -> None:
    for lanes in ("4", "16"):
        assert draw(BALDWINLAB_CACHE=str(tmp_path), BALDWINLAB_LANES=lanes).stdout == EXPECTED
    assert len(list(tmp_path.glob("engine-*"))) == 2
