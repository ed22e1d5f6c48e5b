"""The results of a study or of a gallery as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

from baldwinlab.core import console
from baldwinlab.core.file_writing import UnwrittenFile
from baldwinlab.core.files import parse_json, read_json
from baldwinlab.experiment.conditions import MULTIVERSE
from baldwinlab.studies.status import CLAIMS_FILE, read_claims
from baldwinlab.studies.store import StudyStore

UnwrittenFiles = Mapping[Path, UnwrittenFile]
NO_FILES: Final[UnwrittenFiles] = MappingProxyType({})
# Files with further results of a study, by key.
STUDY_FILES: Final = {"baldwin": "baldwin.json", "multiverse": "multiverse.json"}
# Files of a gallery, by key.
GALLERY_FILES: Final = {"answers": "gallery.json", "papers": "papers.json"}


def print_results(
    study: StudyStore, last: int = 10, baseline: str = "", unwritten: UnwrittenFiles = NO_FILES
) -> None:
    """Print the results of a study as JSON.

    The results are the comparisons of the conditions, the claims, and the stored results on the
    Baldwin effect and of a multiverse. `unwritten`: results that could not be stored.
    """
    # Imported late, because SciPy's statistics take a while to load.
    from baldwinlab.api.publish.comparisons import compare_study, record_contrasts

    result = {
        "directory": str(study.directory),
        "runs": {name: len(study.runs(name)) for name in study.experiments},
    }
    if study.kind != MULTIVERSE:
        contrasts = compare_study(study, last, baseline)
        result["comparison"] = record_contrasts(contrasts)
    claims_file = unwritten.get(study.directory / CLAIMS_FILE)
    claims = parse_json(claims_file.content)["claims"] if claims_file else read_claims(study)
    stored_results = _read_files(study.directory, STUDY_FILES, unwritten)
    console.print_json(result | {"claims": claims} | stored_results)


def print_gallery(folder: Path, page: Path, unwritten: UnwrittenFiles = NO_FILES) -> None:
    """Print the answers and the papers of a gallery as JSON."""
    console.print_json({"page": str(page)} | _read_files(folder, GALLERY_FILES, unwritten))


def print_claims(folder: Path) -> None:
    """Print the claims of an atlas, or of the study what-guides, as JSON."""
    console.print_json(_read_files(folder, {"claims": "claims.json"}))


def _read_files(
    folder: Path, files: dict[str, str], unwritten: UnwrittenFiles = NO_FILES
) -> dict[str, Any]:
    """Return the content of the JSON files that exist or could not be stored, by key."""
    paths = {key: folder / name for key, name in files.items()}
    return {
        key: parse_json(unwritten[path].content) if path in unwritten else read_json(path)
        for key, path in paths.items()
        if path in unwritten or path.exists()
    }
