"""Tests of the presets of a lab."""

from __future__ import annotations

from baldwinlab.lab.pages.single_page import STATIC_FOLDER
from baldwinlab.papers import built_in
from tests.lab.client import LabServer, get_error, get_json


def test_the_presets_are_listed_with_their_descriptions_and_the_default(
    lab_server: LabServer,
) -> None:
    response = get_json(lab_server.address, "presets")
    names = [preset["name"] for preset in response["presets"]]
    assert {"evo/A", "self-taught/B"} <= set(names)
    assert all(preset["description"] for preset in response["presets"])
    assert response["default"] == "evo+self-taught/A"
    (shown,) = (preset for preset in response["presets"] if preset["shown"])
    assert (shown["name"], shown["world"]) == (
        "evo+self-taught/B",
        {"generations": 100, "agents": 20, "steps": 5000},
    )
    assert get_json(lab_server.address, "preset", name="evo/B")["name"] == "evo/B"
    message = get_error(lab_server.address, "preset", 404, name="evo/Z")
    assert message.startswith("there is no preset 'evo/Z' (did you mean 'evo/")
    assert len(message) < 200


def test_the_modules_of_the_page_contain_no_preset_name() -> None:
    names = {
        preset
        for paper in built_in().values()
        for preset in paper.experiment_names()
        if len(preset) > 1
    }
    # A command of the explorable names presets.
    folders = {"vendor", "explorable"}
    paths = [path for path in STATIC_FOLDER.rglob("*.js") if path.parent.name not in folders]
    for path in paths:
        assert not {name for name in names if f'"{name}"' in path.read_text("utf-8")}, path.name
