"""The preset `lean` beside `paper`: what each of its parts saves by count, and a judgement of stored studies.

`python -m benchmarks.lean count` prints the rollouts of the whole of Fig. 4, as gaplab estimates them before a study.
`python -m benchmarks.lean judge ARCHIVE.zip …` says whether `lean` gave the fitness and the ranking of `paper`.
"""

from argparse import ArgumentParser
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rich.console import Console
from rich.table import Table
from scipy.stats import kendalltau

from benchmarks import lean_ratios
from benchmarks.differences import Difference
from benchmarks.findings import opened, table_of
from benchmarks.lean_count import count_table
from gaplab.schemas.comparisons import Comparison
from gaplab.schemas.resolved import ResolvedSpec
from gaplab.services.core.equivalence import SIGNIFICANT
from gaplab.services.core.statistics import holm
from gaplab.services.core.stored_specs import spec_of
from gaplab.services.results.comparisons import Margin, compare
from gaplab.services.results.curves import curves, recorded_of
from gaplab.services.specs.resolution import takes_samples
from gaplab.services.store.queries import experiments
from gaplab.services.store.session import Store

SHARE = 0.03
"""Margin of equivalence, as a share of the mean fitness of the paper's `direct`."""

COUNTS = (1, 3, 5)
COLUMNS = "strategy", "after", "n", "difference", "test", "p", "shown if 0", "p of 0", "verdict"
"""Of the table of differences.

*Shown if 0* is the probability that a true difference of 0 is shown to be within; *p of 0* is that of the hypothesis
that there is no difference, after Holm's correction over the strategies' rows.
"""


class World(NamedTuple):
    """What experiments must share to be compared: the robot, the engine of the simulators, and reality."""

    robot: str
    engine: str
    reality: str

    @classmethod
    def of(cls, spec: ResolvedSpec) -> "World":
        """Return the world of an experiment."""
        return cls(spec.robot.model_dump_json(), spec.engine.model_dump_json(), spec.reality.model_dump_json())


@dataclass
class Sides:
    """The experiments of one world, by preset.

    Attributes:
        lean: ids by name of the strategy.
        paper: the same.
    """

    lean: dict[str, str] = field(default_factory=dict)
    paper: dict[str, str] = field(default_factory=dict)

    @property
    def both(self) -> list[str]:
        """Return the strategies of both sides."""
        return [name for name in self.lean if name in self.paper]


def sides(store: Store, ids: Iterable[str]) -> dict[World, Sides]:
    """Return the experiments of each world; those of other presets are left out.

    Raises:
        SystemExit: a strategy is there twice with the same preset.
    """
    found: dict[World, Sides] = defaultdict(Sides)
    for id_ in ids:
        with store.reading() as session:
            spec = spec_of(experiments.get_experiment(session, id_).spec)
        side = getattr(found[World.of(spec)], spec.budget.preset, None)
        if isinstance(side, dict) and side.setdefault(spec.strategy.name, id_) != id_:
            raise SystemExit(f"{spec.strategy.name} is there twice with {spec.budget.preset}; judge them one by one")
    return {world: each for world, each in found.items() if each.both}


def means(store: Store, ids: Sequence[str]) -> dict[str, dict[int, float]]:
    """Return the mean recorded fitness of experiments by number of evaluations; a level has it at 0 alone."""
    return {
        curve.experiment: {point.evaluations: point.mean for point in curve.points if point.mean is not None}
        for curve in curves(store, ids)
    }


def margin_of(store: Store, side: Sides, direct: float | None) -> float:
    """Return the margin in the unit of fitness.

    Raises:
        SystemExit: there is no `direct` with the preset `paper`, and none was given.
    """
    if direct is None and "direct" in side.paper:
        direct = means(store, [side.paper["direct"]])[side.paper["direct"]].get(0)
    if direct is None:
        raise SystemExit("no archive has `direct` with the preset `paper`; give its mean fitness with --direct")
    return SHARE * direct


def equivalence_rows(store: Store, side: Sides, margin: float) -> Iterator[tuple[str, ...]]:
    """Yield the difference of `lean` from `paper` for each strategy and count, and two one-sided tests of it.

    The last rows are of the mean of the differences of all strategies, which has a smaller error than each.
    """
    differences: dict[int, list[Difference]] = defaultdict(list)
    rows: list[tuple[tuple[str, ...], Comparison]] = []
    for name in side.both:
        pair = [side.lean[name], side.paper[name]]
        known = means(store, pair)
        with store.reading() as session:
            _, recorded = recorded_of(session, pair)
        shared = [count for count in COUNTS if all(count in known[id_] for id_ in pair)]
        for count in shared or [0]:
            (one,) = compare(
                store, pair, from_evaluations=count, to_evaluations=count, margin=Margin(margin), intervals=False
            )
            assert one.equivalence is not None
            values = [recorded[id_][:, count] for id_ in pair]
            found = (Difference.paired if one.shared_streams else Difference.unpaired)(*values)
            if count and found is not None:
                differences[count].append(found)
            interval, p, power, _ = ("-",) * 4 if found is None else found.cells(margin)
            rows.append(((name, str(count), one.sizes, interval, one.equivalence.test, p, power), one))
    for (row, one), of_none in zip(rows, holm([one.trusted.p for _, one in rows]), strict=True):
        assert one.equivalence is not None
        yield *row, "-" if of_none is None else f"{of_none:.2g}", one.equivalence.verdict.value
    for count, each in sorted(differences.items()):
        if len(each) > 1:
            mean = Difference.sum([(1 / len(each), one) for one in each])
            interval, p, power, verdict = mean.cells(margin)
            yield f"mean of {len(each)}", str(count), "", interval, "welch", p, power, f"{mean.p:.2g}", verdict


def ranking_rows(store: Store, side: Sides) -> Iterator[tuple[str, ...]]:
    """Yield the order of strategies under both presets after each count, and the pairs that both tell apart."""
    with store.reading() as session:
        specs = {name: spec_of(experiments.get_experiment(session, side.lean[name]).spec) for name in side.both}
    names = [name for name in side.both if takes_samples(specs[name])]
    known = means(store, [ids[name] for ids in (side.lean, side.paper) for name in names])
    for count in COUNTS if len(names) > 1 else ():
        if not all(count in curve for curve in known.values()):
            continue
        lean, paper = ({name: known[ids[name]][count] for name in names} for ids in (side.lean, side.paper))
        orders = [sorted(names, key=fitness.__getitem__, reverse=True) for fitness in (lean, paper)]
        tau = kendalltau([lean[name] for name in names], [paper[name] for name in names]).statistic
        apart = [_apart(store, {name: ids[name] for name in names}, count) for ids in (side.lean, side.paper)]
        same, opposite = len(apart[0] & apart[1]), len({(low, high) for high, low in apart[0]} & apart[1])
        told = f"{len(apart[0])}, {len(apart[1])}; {same} in both, {opposite} opposite"
        yield str(count), *(" > ".join(order) for order in orders), _same(orders), f"{tau:.2f}", told


def _same(orders: Sequence[Sequence[str]]) -> str:
    return "yes" if orders[0] == orders[1] else "no"


def _apart(store: Store, ids: Mapping[str, str], count: int) -> set[tuple[str, str]]:
    """Return the pairs of strategies that the trusted test tells apart after Holm's correction, the fitter first."""
    names = {id_: name for name, id_ in ids.items()}
    pairs = compare(store, list(names), from_evaluations=count, to_evaluations=count, intervals=False)
    found = set()
    for pair in pairs:
        if pair.trusted.p_holm is not None and pair.trusted.p_holm < SIGNIFICANT:
            ordered = (pair.first, pair.second) if (pair.difference or 0.0) > 0 else (pair.second, pair.first)
            found.add((names[ordered[0]], names[ordered[1]]))
    return found


def judge(store: Store, ids: Iterable[str], direct: float | None) -> Iterator[Table]:
    """Yield the tables of each world that has a strategy with both presets.

    Raises:
        SystemExit: there is no such world.
    """
    worlds = sides(store, ids)
    if not worlds:
        raise SystemExit("no strategy is there with both presets, `lean` and `paper`, in the same world")
    for world, side in worlds.items():
        margin = margin_of(store, side, direct)
        title = f"lean − paper, 90 % intervals; two one-sided tests of ±{margin:.3g}\n{world.robot} in {world.engine}"
        table = table_of(title, COLUMNS)
        for row in equivalence_rows(store, side, margin):
            table.add_row(*row)
        yield table
        if "direct" in side.both:
            title = f"The same over the direct baseline of each; two one-sided tests of ±{SHARE}"
            table = table_of(title, lean_ratios.COLUMNS)
            for row in lean_ratios.ratio_rows(store, side.lean, side.paper, COUNTS, SHARE):
                table.add_row(*row)
            yield table
        columns = "after", "order under lean", "order under paper", "same", "Kendall's τ", "pairs told apart"
        table = table_of("Ranking of the strategies that take samples", columns)
        for row in ranking_rows(store, side):
            table.add_row(*row)
        yield table


def main() -> None:
    """Print the tables of a command."""
    parser = ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("count")
    judging = commands.add_parser("judge")
    judging.add_argument("archives", nargs="+", type=Path)
    judging.add_argument("--direct", type=float, help="mean fitness of `direct` at the paper's budget; default: stored")
    arguments = parser.parse_args()
    console = Console()
    if arguments.command == "count":
        console.print(count_table())
        return
    with opened(arguments.archives) as (store, labels):
        for table in judge(store, labels, arguments.direct):
            console.print(table)


if __name__ == "__main__":
    main()
