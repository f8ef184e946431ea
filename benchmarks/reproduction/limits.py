"""What a reconstruction cannot know, in sentences."""

from collections.abc import Callable, Iterator

OPEN_CHOICES = "docs/decisions/what-the-paper-leaves-open.md"
FAIR = "docs/decisions/a-fair-comparison.md"
ENGINES = "docs/engines.md"
ROBOT = "docs/robot.md"


def limits(link: Callable[[str], str]) -> Iterator[str]:
    """Yield the limits, each with its source.

    Args:
        link: returns the address of a file of the repository, seen from the document.
    """
    yield (
        "**The robot and the evolutionary algorithm.** The paper leaves both to its reference [10], which could not "
        "be found. Body, masses, motors, pulse period, length of an episode, population, selection, crossover and "
        f"mutation are [choices of ours]({link(OPEN_CHOICES)}). A [robot]({link(ROBOT)}) with another gap has other "
        "ratios before any sample (C1). Its hand-designed controller, from which *known fit* draws, has 0.41 of direct "
        "in MuJoCo, 0.49 in PhysX and 0.48 in PyBullet, under `lean`; the paper's has 0.55. So that strategy starts "
        "worse here (C5c, C6). Source: paper, section 2."
    )
    yield (
        "**The unit of fitness.** The paper prints 1.33 without a unit, so only ratios to its direct baseline can be "
        "compared. It prints 0.9, 1.3 and 1.4 with one decimal, so these ratios are uncertain by ±0.04. Source: paper, "
        "section 3."
    )
    yield (
        "**The bounds of the coefficients.** How wrong a random simulator is depends on them, and the paper does not "
        "state them. Source: paper, section 2."
    )
    yield (
        "**The points of Fig. 4.** They are in a picture, and the text has few of them; so no curve is compared point "
        "by point. Fig. 3 has no numbers at all. Source: paper, section 3."
    )
    yield (
        "**The size of a selection's search, and the weights.** The paper does not say whether informative selections "
        "spend as many evaluations as others, nor what a perfect simulator weighs: "
        f"[a fair comparison]({link(FAIR)}). Source: paper, section 2."
    )
    yield (
        "**The engine.** The paper ran a version of PhysX of its time. Today's engines "
        f"[differ from each other]({link(ENGINES)}) about as much as one engine differs from itself "
        "if both frictions are 0.5. No study here has simulators in PhysX: where reality is in PhysX, they are in "
        "MuJoCo. Source: paper, section 2."
    )
    yield (
        "**The tests.** The paper combines the values after several numbers of samples. If it takes those of one "
        "repetition as independent, as it seems, its p-values are too small. If its repetitions behave as ours, "
        "those of strategies with simulated fit are far too small; those of the other three are less so: with a "
        "correlation of 0.1, its 0.017 for *known fit* and *random* (C5c) is 0.067. Its "
        'sentences on strategies that differ "from the others" have two readings (C5b, C6). Source: caption of Fig. 4.'
    )
