"""Extras: the installation command uses the origin of the package and names missing packages."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest

import baldwinlab
from baldwinlab.core import extras
from baldwinlab.core.extras import installation_command, missing_extra_error, missing_packages


def record_installation(folder: Path, origin: dict[str, Any] | None) -> None:
    """Write the metadata of an installation as pip does (PEP 376, PEP 610)."""
    metadata = folder / "baldwinlab-9.dist-info"
    metadata.mkdir()
    lines = ["Metadata-Version: 2.1", "Name: baldwinlab", "Version: 9", "Requires-Dist: numpy>=2"]
    lines += [f"Requires-Dist: {name}; extra == 'lab'" for name in ("numpy", "no-such-package>=3")]
    (metadata / "METADATA").write_text("\n".join(lines) + "\n")
    if origin is not None:
        (metadata / "direct_url.json").write_text(json.dumps(origin))


@pytest.fixture
def site_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return an empty folder of packages that hides the real installation."""
    folder = tmp_path / "site-packages"
    folder.mkdir()
    monkeypatch.setattr(sys, "path", [str(folder)])
    return folder


def test_an_extra_of_an_installation_from_an_index_is_installed_by_name(site_folder: Path) -> None:
    record_installation(site_folder, None)
    assert installation_command("lab") == 'pip install "baldwinlab[lab]"'


@pytest.mark.parametrize("editable", [True, False])
def test_an_extra_of_an_installation_from_a_folder_is_installed_from_the_folder(
    site_folder: Path, tmp_path: Path, editable: bool
) -> None:
    source = tmp_path / "my source"
    source.mkdir()
    (source / "pyproject.toml").touch()
    record_installation(site_folder, {"url": source.as_uri(), "dir_info": {"editable": editable}})
    assert installation_command("lab") == f'pip install {"-e " * editable}"{source}[lab]"'


def test_a_folder_that_was_deleted_is_not_named(site_folder: Path, tmp_path: Path) -> None:
    record_installation(site_folder, {"url": (tmp_path / "deleted").as_uri(), "dir_info": {}})
    assert (
        installation_command("lab")
        == 'pip install ".[lab]" in the folder of the source of baldwinlab'
    )


@pytest.mark.parametrize(
    ("origin", "source"),
    [
        ({"url": "file:///w/b.whl", "archive_info": {}}, "file:///w/b.whl"),
        (
            {"url": "https://x/b", "vcs_info": {"vcs": "git", "commit_id": "abc"}},
            "git+https://x/b@abc",
        ),
    ],
)
def test_an_extra_of_an_installation_from_a_file_or_repository_is_installed_from_it(
    site_folder: Path, origin: dict[str, Any], source: str
) -> None:
    record_installation(site_folder, origin)
    assert installation_command("lab") == f'pip install "baldwinlab[lab] @ {source}"'


def test_an_extra_without_an_installation_is_installed_from_the_source_folder(
    site_folder: Path,
) -> None:
    source = Path(baldwinlab.__file__).parents[1]
    assert installation_command("lab") == f'pip install -e "{source}[lab]"'
    assert missing_packages("lab") == []


def test_the_error_names_only_the_missing_packages(site_folder: Path) -> None:
    record_installation(site_folder, None)
    (site_folder / "numpy-2.dist-info").mkdir()
    (site_folder / "numpy-2.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: numpy\nVersion: 2\n"
    )
    assert str(missing_extra_error("lab", "the lab")) == (
        "the lab needs the extra 'lab' (not installed: no-such-package): "
        'pip install "baldwinlab[lab]"'
    )


def test_every_extra_with_a_purpose_is_declared() -> None:
    assert extras.EXTRA_PURPOSES.keys() < extras.required_packages().keys()
