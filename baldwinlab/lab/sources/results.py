"""The results of a study: curves, final values, claims and reaction norms, as JSON.

The functions return encoded JSON, because the cache of a lab stores bytes. A key of the cache
contains the modification times of the files, so that a change of a file gives new results.
"""

from __future__ import annotations

from typing import Any

from baldwinlab.core.files import find_paths
from baldwinlab.lab import Lab, MissingError, Query, read_text
from baldwinlab.lab.sources.studies import (
    find_requested_condition,
    find_study,
    read_versions,
    require_inside,
)
from baldwinlab.studies.open import open_sample
from baldwinlab.studies.records import StudyError
from baldwinlab.studies.status import CLAIMS_FILE, read_claims
from baldwinlab.studies.store import StudyStore
from baldwinlab.studies.sweeps import design as sweeps


def load_results(lab: Lab, query: Query) -> bytes:
    """Return the curves, final values and claims of a study, as JSON.

    A missing number is null. If the report has stored the results and they are up to date, they are
    not computed again. If the claims are not valid, `problem` contains the error.
    """
    # This import takes time.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, read_text(query, "study"))
    record_paths = [file.path for condition in study.experiments for file in study.files(condition)]
    claims_path = study.directory / CLAIMS_FILE
    cache_path = study.directory / lab_results.CACHE_FILE
    sweep_path = study.directory / sweeps.SWEEP_FILE_NAME
    for path in (cache_path, sweep_path):
        require_inside(lab.root, path)
    # The results depend only on these files, so their versions are the key of the cache.
    versions = read_versions(lab.root, [*record_paths, claims_path])

    def make() -> dict[str, Any]:
        results = lab_results.load_cached_results(study) or lab_results.compute_results(study)
        return results | _read_claims_or_error(study)

    return lab.cache.get_json(("results", study.directory, versions), make)


def _read_claims_or_error(study: StudyStore) -> dict[str, Any]:
    """Return `claims`, and `problem`: the error if the claims are not valid, else None."""
    try:
        return {"claims": read_claims(study), "problem": None}
    except StudyError as error:
        return {"claims": [], "problem": str(error)}


def load_typical_run(lab: Lab, query: Query) -> bytes:
    """Return {"run": INDEX} as JSON: the run nearest to the median final fitness."""
    study, condition = find_requested_condition(lab, query)
    name = condition.name
    versions = read_versions(lab.root, [file.path for file in study.files(name)])
    if not versions:
        raise MissingError(f"{study.location} has no run of {name}")

    def make() -> dict[str, int]:
        # This import takes time.
        from baldwinlab.analysis.statistics.fitness import typical_run

        return {"run": typical_run(open_sample(study, [name]), name)}

    return lab.cache.get_json(("typical", study.directory, name, versions), make)


def load_run_curves(lab: Lab, query: Query) -> bytes:
    """Return the curve of a measure for each run of a condition, as JSON."""
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish import lab_results

    study, condition = find_requested_condition(lab, query)
    name, measure = condition.name, read_text(query, "measure")
    versions = read_versions(lab.root, [file.path for file in study.files(name)])
    return lab.cache.get_json(
        ("runs", study.directory, name, measure, versions),
        lambda: lab_results.read_run_curves(study, name, measure),
    )


def load_reaction_norms(lab: Lab, query: Query) -> bytes:
    """Return the reaction norms of a study, as JSON. They are empty if the assay is not stored."""
    # This import takes a second, which would delay the first page.
    from baldwinlab.api.publish import lab_results

    study = find_study(lab, read_text(query, "study"))
    folder = study.directory / "assays" / "reaction"
    versions = read_versions(lab.root, [folder, *find_paths(folder, "**/*.nc")])
    return lab.cache.get_json(
        ("reaction", study.directory, versions), lambda: lab_results.read_reaction_norms(study)
    )
