"""The form of an experiment: its fields, its errors, and a preview of its world."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from baldwinlab.experiment import BaseExperiment, Experiment, ExperimentError, registry, validate
from baldwinlab.experiment.conditions import Factors
from baldwinlab.lab import Lab, Query, read_body_number
from baldwinlab.lab.sources.freezer import require_usable_founders
from baldwinlab.lab.sources.limits import check_size
from baldwinlab.lab.sources.model_displays import describe_species
from baldwinlab.lab.sources.presets import choose_default_preset, list_presets
from baldwinlab.models.miniworld.appearance import describe_appearance, list_topics
from baldwinlab.simulation.simulate import check_seed

# In the message about an unknown field, this text follows the path of the field.
UNKNOWN_FIELD_MESSAGE = ": there is no such field"

# The first choices of the form, in words, by preset.
CHOICES: Final = {
    "evo+self-taught/A": "Agents that learn",
    "evo/A": "Agents that do not learn",
    "evo+self-taught/B": "Learning, food off course",
    "self-taught/A": "Learning without evolution",
}


def check(lab: Lab, body: dict[str, Any]) -> dict[str, Any]:
    """Return `errors` of an experiment or of its live run, and a `note` if the runs are too few."""
    errors = find_errors(body.get("experiment")) or _find_limit_errors(lab, body)
    return {"errors": errors, "note": "" if errors else _describe_sample_size(body)}


def preview_world(lab: Lab, body: dict[str, Any]) -> dict[str, Any]:
    """Return the world of an experiment, which the form shows before a run starts."""
    experiment = validate(body.get("experiment", {}))
    if not isinstance(experiment, Experiment):
        return {"world": None, "appearance": None}
    return describe_world(experiment)


def describe_world(experiment: Experiment) -> dict[str, Any]:
    """Return entries of the header of a recording: `world`, `appearance`, `topics`, `species`."""
    return {
        "world": experiment.world.model_dump(mode="json"),
        "appearance": describe_appearance(experiment).to_dict(),
        "topics": [topic._asdict() for topic in list_topics(experiment)],
        **describe_species(experiment),
    }


def make_schema(kind: type[BaseExperiment]) -> Any:
    """Return the JSON schema of an experiment class, with the names of all available parts."""
    return _with_part_names(kind.model_json_schema())


def _with_part_names(node: Any) -> Any:
    if isinstance(node, list):
        return [_with_part_names(item) for item in node]
    if not isinstance(node, dict):
        return node
    part_names = {"enum": registry.names(node["x-chooses"])} if "x-chooses" in node else {}
    return {key: _with_part_names(value) for key, value in node.items()} | part_names


def describe_presets(lab: Lab, query: Query) -> dict[str, Any]:
    """Return all presets, the first choices, and the name of the preset that is shown first."""
    return {"presets": list_presets(), "choices": CHOICES, "default": choose_default_preset()}


def load_form(lab: Lab, body: dict[str, Any]) -> dict[str, Any]:
    """Return the result of `make_form` for the experiment of a request."""
    return make_form(body.get("experiment"))


def make_form(tree: Any) -> dict[str, Any]:
    """Return the JSON schema of an experiment with its parts, and the experiment with all settings.

    Tables of parts that the experiment does not use are left out. Missing tables get their
    defaults. An invalid experiment is returned unchanged, with the schema of `Experiment`.
    """
    try:
        experiment = complete_experiment(tree)
    except ExperimentError:
        return {"schema": make_schema(Experiment), "experiment": tree}
    return {"schema": make_schema(type(experiment)), "experiment": experiment.to_dict()}


def complete_experiment(tree: Any) -> BaseExperiment:
    """Return the experiment of a tree, without the tables of parts that it does not use."""
    # If a user of the form chooses another part, the tree still has the table of the old part.
    # Validation reports such a table as an unknown field.
    while True:
        try:
            experiment: BaseExperiment = validate(tree)
            return experiment
        except ExperimentError as error:
            pruned_tree = tree
            for path in _list_unknown_fields(str(error)):
                pruned_tree = _remove_table(pruned_tree, path.split("."))
            if pruned_tree == tree:
                raise
            tree = pruned_tree


def _list_unknown_fields(message: str) -> Iterator[str]:
    """Yield the paths of unknown fields in an error message with one line per field."""
    for line in message.splitlines():
        path, separator, _ = line.partition(UNKNOWN_FIELD_MESSAGE)
        if separator:
            yield path


def _remove_table(tree: Any, path: list[str]) -> Any:
    """Return a copy of a tree without the table at a path. A value that is not a table stays."""
    first_name, *child_path = path
    if not isinstance(tree, dict) or first_name not in tree:
        return tree
    child = tree[first_name]
    if child_path:
        return tree | {first_name: _remove_table(child, child_path)}
    if not isinstance(child, dict):
        return dict(tree)
    return {name: value for name, value in tree.items() if name != first_name}


def find_errors(tree: Any) -> list[dict[str, str]]:
    """Return the errors of an experiment: {"path": "lifetime.steps", "message": MESSAGE}, ...

    The path is "" if the error is about the complete experiment.
    """
    try:
        validate(tree)
    except ExperimentError as error:
        return [
            {"path": _find_error_path(line, tree), "message": line}
            for line in str(error).splitlines()
        ]
    return []


def _find_limit_errors(lab: Lab, body: dict[str, Any]) -> list[dict[str, str]]:
    """Return the first error of a live run of a valid experiment: its size, seed or founders."""
    if "runs" not in body:
        return []
    try:
        n_runs = read_body_number(body, "runs", 1)
        check_seed(read_body_number(body, "seed", 0))
        experiment = validate(body["experiment"])
        check_size(experiment, n_runs)
        require_usable_founders(lab, experiment, n_runs)
    except ValueError as error:
        message = str(error)
        path = _find_error_path(message, body) or _find_error_path(message, body["experiment"])
        return [{"path": path, "message": message}]
    return []


def _describe_sample_size(body: dict[str, Any]) -> str:
    """Return a note if there are too few runs to compare two conditions, else ""."""
    # This import of SciPy's statistics takes time.
    from baldwinlab.api.publish.comparisons import describe_planned

    if "runs" not in body:
        return ""
    two_conditions = {"first": Factors(), "second": Factors()}
    n_runs = read_body_number(body, "runs", 1)
    note = describe_planned(two_conditions, n_runs, "Set the number of runs to {runs}.")
    return f"To compare two conditions: {note[0].lower()}{note[1:]}" if note else ""


def _find_error_path(message: str, tree: Any) -> str:
    """Return the path at the beginning of an error message, or "" if `tree` has no such path."""
    first_word, _, _ = message.partition(" ")
    path = first_word.rstrip(":,")
    node = tree
    for step in path.split("."):
        if isinstance(node, list) and step.isdecimal() and int(step) < len(node):
            node = node[int(step)]
        elif isinstance(node, dict) and step in node:
            node = node[step]
        else:
            return ""
    return path
