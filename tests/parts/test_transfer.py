"""A pickle with a custom part loads the part, or names the reason why it cannot."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

import pytest

import baldwinlab as bl
from baldwinlab.core.errors import PartError
from baldwinlab.experiment import registry
from baldwinlab.parts.loading import load_text

RULE = """
from baldwinlab.parts import LearningRule

class Lazy(LearningRule, name="lazy-rule"):
    \"\"\"{}.\"\"\"
"""


def test_a_part_that_differs_or_has_no_module_is_refused_with_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    load_text(RULE.format("First"), tmp_path / "first.py")
    experiment = bl.load("evo/A").replace(learning={"rule": "lazy-rule"})
    content = pickle.dumps(experiment)
    assert pickle.loads(content) == experiment
    load_text(RULE.format("Second"), tmp_path / "second.py")
    with pytest.raises(PartError, match=r"'lazy-rule' of .*first.py differs from the learning"):
        pickle.loads(content)
    registry.remove("learning rule", "lazy-rule")
    assert pickle.loads(content) == experiment
    registry.remove("learning rule", "lazy-rule")

    (tmp_path / "my_rules.py").write_text(RULE.format("Imported"))
    monkeypatch.syspath_prepend(tmp_path)
    __import__("my_rules")
    content = pickle.dumps(experiment)
    monkeypatch.delitem(sys.modules, "my_rules")
    registry.remove("learning rule", "lazy-rule")
    assert pickle.loads(content) == experiment
    monkeypatch.delitem(sys.modules, "my_rules")
    registry.remove("learning rule", "lazy-rule")
    (tmp_path / "my_rules.py").unlink()
    with pytest.raises(PartError, match=r"my_rules.py cannot be imported: ModuleNotFound"):
        pickle.loads(content)
