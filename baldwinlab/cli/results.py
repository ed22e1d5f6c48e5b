"""The results of a study as JSON."""

from __future__ import annotations

from baldwinlab.core import console
from baldwinlab.experiment.factors import MULTIVERSE
from baldwinlab.studies.claims_file import read_claims
from baldwinlab.studies.store import StudyStore


def print_results(study: StudyStore, last: int = 10, baseline: str = "") -> None:
    """Print the comparisons of the conditions and the stored claims of a study as JSON.

    Parameters
    ----------
    study
        The directory of the study.
    last
        Number of final generations that are averaged in each run.
    baseline
        Condition with which all others are compared, or "" for the default.
    """
    # Imported late: SciPy's statistics take a while to load.
    from baldwinlab.api.publish import lab_results

    result = {
        "directory": str(study.directory),
        "runs": {name: len(study.runs(name)) for name in study.experiments},
    }
    if study.kind != MULTIVERSE:
        contrasts = lab_results.compare_study(study, last, baseline)
        result["comparison"] = lab_results.record_contrasts(contrasts)
    console.print_json(result | {"claims": read_claims(study)})
