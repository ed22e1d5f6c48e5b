"""Extras: the command that installs one fits the origin of the installation, and names the missing packages."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

import pytest

import baldwinlab
from baldwinlab.core import extras
from baldwinlab.core.extras import installation_command, missing_extra, missing_packages


def record_installation(folder: Path, origin: dict[str, Any] | None) -> None:
    """Write the metadata that pip writes of an installation (PEP 376, PEP 610)."""
    metadata = folder / "baldwinlab-9.dist-info"
    metadata.mkdir()
    lines = ["Metadata-Version: 2.1", "Name: baldwinlab", "Version: 9", "Requires-Dist: numpy>=2"]
    lines += [f"Requires-Dist: {name}; extra == 'lab'" for name in ("numpy", "no-such-package>=3")]
    (metadata / "METADATA").write_text("\n".join(lines) + "\n")
    if origin is not None:
        (metadata / "direct_url.json").write_text(json.dumps(origin))


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of packages that hides the real installation."""
    folder = tmp_path / "site-packages"
    folder.mkdir()
    monkeypatch.setattr(sys, "path", [str(folder)])
    return folder


def test_an_installation_from_an_index_is_extended_by_name(site: Path) -> None:
    record_installation(site, None)
    assert installation_command("lab") == 'pip install "baldwinlab[lab]"'


@pytest.mark.parametrize("editable", [True, False])
def test_an_installation_from_a_folder_is_extended_from_that_folder(
    site: Path, tmp_path: Path, editable: bool
) -> None:
    source = tmp_path / "my source"
    source.mkdir()
    (source / "pyproject.toml").touch()
    record_installation(site, {"url": source.as_uri(), "dir_info": {"editable": editable}})
    assert installation_command("lab") == f'pip install {"-e " * editable}"{source}[lab]"'


def test_a_folder_that_was_deleted_is_not_named(site: Path, tmp_path: Path) -> None:
    record_installation(site, {"url": (tmp_path / "deleted").as_uri(), "dir_info": {}})
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
def test_an_installation_from_a_file_or_repository_is_extended_from_it(
    site: Path, origin: dict[str, Any], source: str
) -> None:
    record_installation(site, origin)
    assert installation_command("lab") == f'pip install "baldwinlab[lab] @ {source}"'


def test_a_source_that_is_not_installed_is_installed_from_its_folder(site: Path) -> None:
    source = Path(baldwinlab.__file__).parents[1]
    assert installation_command("lab") == f'pip install -e "{source}[lab]"'
    assert missing_packages("lab") == []


def test_the_error_names_the_missing_packages_alone(site: Path) -> None:
    record_installation(site, None)
    (site / "numpy-2.dist-info").mkdir()
    (site / "numpy-2.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.1\nName: numpy\nVersion: 2\n"
    )
    assert str(missing_extra("lab", "the lab")) == (
        "the lab needs the extra 'lab' (not installed: no-such-package): pip install \"baldwinlab[lab]\""
    )


def test_every_extra_with_a_purpose_is_declared() -> None:
    assert extras.PURPOSES.keys() < extras.required_packages().keys()


def test_one_module_alone_writes_the_command() -> None:
    package = Path(baldwinlab.__file__).parent
    writes = {
        path.name for path in package.rglob("*.py") if re.search(r"baldwinlab\[", path.read_text())
    }
    assert writes == {"extras.py"}
