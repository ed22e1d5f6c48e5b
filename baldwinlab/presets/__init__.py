"""The paper's conditions, maps and readings, and our controls: small TOML files laid over the defaults of an experiment.

A preset is named CONDITION/MAP or CONTROL/MAP, such as `evo+self-taught/B`; a reading is one more layer.
"""

from __future__ import annotations

import tomllib
from difflib import get_close_matches
from importlib.resources import files
from pathlib import Path
from typing import Any

from baldwinlab.experiment import Experiment, ExperimentError, merge, validate
from baldwinlab.experiment.toml import from_toml
from baldwinlab.factors import Factors

KINDS = ("conditions", "controls", "maps", "readings")


def names(kind: str) -> list[str]:
    """The presets of a kind (one of `KINDS`), the standard reading first."""
    found = sorted(
        entry.name.removesuffix(".toml") for entry in (files(__name__) / kind).iterdir() if entry.name.endswith(".toml")
    )
    return sorted(found, key=lambda name: name != "standard")


def describe(kind: str, name: str) -> str:
    """What a preset is, in a line."""
    return str(_layer(kind, name)["description"])


def changes(reading: str) -> dict[str, Any]:
    """The fields that a reading sets, as `Experiment.replace` takes them. Raises ExperimentError for an unknown one."""
    return {part: fields for part, fields in _layer("readings", reading).items() if part != "description"}


def _layer(kind: str, name: str) -> dict[str, Any]:
    known = names(kind)
    if name not in known:
        raise ExperimentError(
            f"there is no {kind.removesuffix('s')} {name!r}{_nearest(name, known)}; there are {', '.join(known)}"
        )
    return tomllib.loads((files(__name__) / kind / f"{name}.toml").read_text("utf-8"))


def _nearest(name: str, known: list[str]) -> str:
    near = get_close_matches(name, known, n=1)
    return f" (did you mean {near[0]!r}?)" if near else ""


def _conditions() -> list[str]:
    return [*names("conditions"), *names("controls")]


def load(experiment: str | Path, reading: str = "standard") -> Experiment:
    """An experiment by the name of a preset (`evo+self-taught/B`), or from a TOML file.

    `reading` lays one of the named readings of the paper over it. Raises ExperimentError when there is no such preset, file
    or reading, or when the file's experiment is not valid.
    """
    text = str(experiment)
    if text.endswith(".toml"):
        return _load_file(Path(experiment), reading)
    condition, slash, map_name = text.rpartition("/")
    if not slash:
        known = [f"{condition}/{map_name}" for condition in _conditions() for map_name in names("maps")]
        raise ExperimentError(
            f"there is no preset {text!r}{_nearest(text, known)}; there are {', '.join(known)}, and any file that ends in .toml"
        )
    tree: dict[str, Any] = {"name": text}
    first = "controls" if condition in names("controls") else "conditions"
    for kind, name in ((first, condition), ("maps", map_name), ("readings", reading)):
        tree = merge(tree, _layer(kind, name))
    del tree["description"]
    return validate(tree)


def factors(experiment: str | Path) -> Factors:
    """The learner and the map that `load` puts together; of a TOML file, neither is known."""
    text = str(experiment)
    if text.endswith(".toml"):
        return Factors()
    learner, _, map_name = text.rpartition("/")
    return Factors(learner, map_name)


def _load_file(path: Path, reading: str) -> Experiment:
    try:
        content = path.read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise ExperimentError(f"cannot read {path}: {reason}") from None
    return from_toml(content, where=str(path)).replace(**changes(reading))


def paper(reading: str = "standard") -> list[Experiment]:
    """The paper's six conditions."""
    return [load(f"{condition}/{map_name}", reading) for map_name in names("maps") for condition in names("conditions")]
