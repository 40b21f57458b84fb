"""All jobs through a crew, whatever becomes of its workers."""

import time
from collections.abc import Callable, Iterable, Iterator

from .channels import Tiding
from .crews import Crew, Future, Hire
from .job import Job
from .work import Outcome

POLL = 0.1
"""s between two looks at who is done"""
Look = Callable[[Iterable[Tiding]], None]
"""told regularly what workers are doing"""


def outcomes(jobs: Iterable[Job], hire: Hire, look: Look) -> Iterator[Outcome]:
    """The outcome of every job, as they come.

    Where a process dies and takes the others with it (a segmentation fault, or no memory left), those jobs that were
    being done are done again, each alone in a process; the one that dies again is the one to blame, and has failed.
    """
    left = {job.key: job for job in jobs}
    while left:
        with hire() as crew:
            for outcome in _until_one_dies(crew, list(left.values()), look):
                del left[outcome.key]
                yield outcome
            begun = {tiding.key for tiding in crew.tidings()}
        for job in [job for key, job in left.items() if key in begun or not begun & left.keys()]:
            yield _alone(job, hire, look)
            del left[job.key]


def _until_one_dies(crew: Crew, jobs: list[Job], look: Look) -> Iterator[Outcome]:
    futures: dict[str, Future] = {job.key: crew.submit(job) for job in jobs}
    dead = False
    while futures and not dead:
        time.sleep(POLL)
        look(crew.tidings())
        for key in [key for key, future in futures.items() if future.done()]:
            try:
                outcome = futures[key].result()
            except Exception as error:
                if not _is_the_end_of_all(error):
                    yield Outcome(key, {}, _died(error), 0.0)
                    del futures[key]
                dead = dead or _is_the_end_of_all(error)
                continue
            del futures[key]
            yield outcome


def _alone(job: Job, hire: Hire, look: Look) -> Outcome:
    with hire(1) as crew:
        future = crew.submit(job)
        while not future.done():
            time.sleep(POLL)
            look(crew.tidings())
        try:
            return future.result()
        except Exception as error:
            return Outcome(job.key, {}, _died(error), 0.0)


def _is_the_end_of_all(error: Exception) -> bool:
    """Whether the crew is of no more use: a pool of processes is broken as a whole, a cluster is not."""
    from concurrent.futures.process import BrokenProcessPool

    return isinstance(error, BrokenProcessPool)


def _died(error: Exception) -> str:
    said = " ".join(str(error).split()) or "no text"
    return f"its process died, as from a fault in compiled code or for want of memory ({type(error).__name__}: {said})"
