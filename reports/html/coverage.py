"""What a run's figures rest on, in words: too little truth, and frames that not every estimator has."""

from fgbaseline.compare import MIN_COVERAGE, MIN_SAMPLE_SIZE, is_insufficient
from fgbaseline.reports.common_frames import known, same_frames, share_of_time
from fgbaseline.reports.comparison import Run
from fgbaseline.reports.samples import of_truth

from ..formatting import listed, number, per_cent


def little_truth_sentences(run: Run) -> list[str]:
    """That the truth is too little to judge by, where it is."""
    sample = of_truth(run)
    if sample is None or not is_insufficient(sample, MIN_SAMPLE_SIZE, MIN_COVERAGE):
        return []
    n = int(sample["n"])
    return [
        f"Too little truth to judge by: {number(n)} of {number(run.problem.n_frames)} frames "
        f"{'has' if n == 1 else 'have'} one, over {per_cent(sample['coverage'])} of the recording's time; "
        f"fgbaseline check asks for {MIN_SAMPLE_SIZE} over {per_cent(MIN_COVERAGE)}."
    ]


def coverage_sentences(run: Run) -> list[str]:
    """What each estimator covers, where not all cover the same, and which frames rank them."""
    tables = {r.name: r.divergence for r in run.answered if r.divergence is not None}
    frames = {name: known(table) for name, table in tables.items()}
    if len(frames) < 2 or same_frames(frames.values()):
        return []
    t = run.problem.sequence.t
    each = listed(f"{name} {per_cent(share_of_time(t, there))}" for name, there in frames.items())
    common = {name: run.results[name].divergence_common for name in frames}
    counts = {c.frames for c in common.values() if c is not None}
    apart = [name for name, c in common.items() if c is None]
    text = f"The estimators do not cover the same share of the recording's time: {each}."
    if not counts:
        return [f"{text} They have no frame in common, so they are not ranked."]
    who = "the others have" if apart else "all have"
    ranked = f"{text} They are ranked by their errors over the {number(counts.pop())} frames that {who}"
    return [f"{ranked}; {listed(apart)} {'is' if len(apart) == 1 else 'are'} not ranked." if apart else f"{ranked}."]
