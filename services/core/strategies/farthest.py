"""Try what differs most from all that was tried."""

import numpy as np
from numpy.random import Generator

from gaplab.services.core.arrays import FloatArray, Genome, Genomes, Outcomes
from gaplab.services.core.strategies.base import Search, Strategy
from gaplab.services.core.types import Belief


class Farthest(Strategy):
    """The controller whose nearest sample is farthest away: by its commands, or else by what sensors would read.

    Of recordings with commands, it is the root mean square difference of the commands, and costs no rollout. Of others,
    it is that between the readings in the best simulator and those of the samples. The first recording is random; the
    first of other controllers is far from the mean of those that a search begins with. Do not use it where the unusual
    teaches little of the usual: of a recorded arm's motions, random ones left smaller errors.
    """

    name = "farthest"
    source = "Johnson, Moore and Ylvisaker 1990: maximin distance designs"
    needs_fitness = False

    def select(self, belief: Belief, search: Search, rng: Generator) -> Genome:
        """Return the genome whose smallest distance to a sample is largest."""
        samples, left = belief.learnable, belief.candidates
        if left is not None and not samples:
            first: Genome = belief.draw(1, rng)[0]
            return first
        if left is not None and belief.commands is not None:
            chosen = belief.commands[[int(each.genome[0]) for each in samples]]
            left = belief.draw(len(left), rng)
            farthest: Genome = left[np.argmax(_apart(belief.commands[left[:, 0].astype(int)], chosen))]
            return farthest

        known = list[FloatArray]()

        def score(_: Genomes, outcomes: Outcomes) -> FloatArray:
            points = outcomes[:, 0, 1:] if outcomes.shape[2] > 1 else outcomes[:, 0]  # fitness without sensors
            if not known:
                rows = [each.readings if outcomes.shape[2] > 1 else each.outcome for each in samples]
                known.extend(row for row in rows if row.size == points.shape[1])
            if not known:
                known.append(np.nan_to_num(points).mean(axis=0))
            return np.where(np.isnan(outcomes[:, 0, 0]), np.nan, _apart(points, np.array(known)))

        return search(score, parameters=belief.parameters[:1], senses=True)


def _apart(points: FloatArray, others: FloatArray) -> FloatArray:
    """Return `(n,)`: the least root mean square difference of points `(n, c)` from others `(k, c)`; nan is left out."""
    away = points[:, None, :] - others[None, :, :]
    there = np.isfinite(away)
    squares = np.where(there, away, 0.0) ** 2
    return np.asarray(np.sqrt(squares.sum(axis=2) / np.maximum(there.sum(axis=2), 1)).min(axis=1))
