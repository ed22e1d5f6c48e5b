"""A file that an editor on Windows saved is read as any other file."""

from __future__ import annotations

import codecs
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab import papers
from baldwinlab.papers.claims import read_claims
from baldwinlab.parts import load_file
from baldwinlab.parts.loading import source_of
from baldwinlab.studies.sweeps import read_sweep
from tests.papers.test_papers import write_paper

PART_FILE = Path(__file__).parents[2] / "examples" / "parts" / "bit_strings.py"


def save_on_windows(path: Path, text: str = "") -> Path:
    """Write a text, or the text of the file, as an editor on Windows does."""
    content = (text or path.read_text("utf-8")).replace("\n", "\r\n").encode()
    path.write_bytes(codecs.BOM_UTF8 + content)
    return path


def test_an_experiment_a_sweep_and_claims_are_read(tmp_path: Path) -> None:
    file = save_on_windows(tmp_path / "mine.toml", 'base = "evo/A"\n[lifetime]\nsteps = 5\n')
    assert bl.load(file).lifetime.steps == 5
    plan = 'experiment = "evo/A"\n[fields]\n"learning.rate" = [0.1]\n'
    assert read_sweep(save_on_windows(tmp_path / "sweep.toml", plan)).experiment == "evo/A"
    claim = (
        '[[claims]]\nid = "A"\ntitle = "Food"\nkind = "paper"\nclaim = "Agents eat more on A."\n'
        'rule = "greater"\npaper = "p. 1"\n'
        'comparisons = [{ a = "evo/A", b = "evo/B", measure = "mean" }]\n'
    )
    (read,) = read_claims(save_on_windows(tmp_path / "claims.toml", claim))
    assert read.id == "A"


def test_a_paper_is_read(tmp_path: Path) -> None:
    folder = write_paper(tmp_path / "tiny")
    original = papers.load(folder)
    for path in folder.rglob("*.toml"):
        save_on_windows(path)
    saved = papers.load(folder)
    assert saved.metadata == original.metadata
    assert saved.experiments() == original.experiments()
    assert saved.claims == original.claims


def test_a_part_is_the_same_part(tmp_path: Path) -> None:
    load_file(PART_FILE)
    original = source_of("model", "bit-strings")
    copy = save_on_windows(tmp_path / "bit_strings.py", PART_FILE.read_text("utf-8"))
    load_file(copy)
    assert source_of("model", "bit-strings").sha256 == original.sha256


@pytest.mark.parametrize("encoding", ["utf-16", "latin-1"])
def test_other_encodings_are_refused_in_a_sentence(tmp_path: Path, encoding: str) -> None:
    file = tmp_path / "mine.toml"
    file.write_bytes('base = "evo/A" # \xe4\n'.encode(encoding))
    with pytest.raises(bl.ExperimentError, match="it is not UTF-8 text"):
        bl.load(file)
