"""The gait of a controller: the contacts of its feet, and the height and speed of its base, over time."""

from collections.abc import Sequence

from gaplab.schemas.replays import Interval, Replay, ReplayWorld
from gaplab.services.figures.marks import Axis, Bars, FigureDefinition, Level, Line, Mark, Panel, Table
from gaplab.services.figures.style import INK, Style, style_of
from gaplab.services.figures.words import heading, limits, number

COUNTED = Style(INK, "dotted", "circle")

Named = tuple[str, ReplayWorld]


def gait_figure(replay: Replay, *, title: str | None = None) -> FigureDefinition:
    """Return a figure of footfalls, height and speed in simulation and in reality.

    Args:
        replay: the motion; a world whose physics failed is left out.
        title: text above the figure; by default the controller.
    """
    there = [("In simulation", replay.simulation), ("In reality", replay.reality)]
    worlds = [(name, world) for name, world in there if world is not None and world.heights_m]
    whose = "sample" if replay.kind == "sample" else "transferred controller"
    own = f"The {whose} of iteration {replay.iteration}, repetition {replay.repetition}"
    time, height = Axis("Time (s)", (0.0, replay.times_s[-1])), _height(replay)
    return FigureDefinition(
        name="gait",
        title=heading(own if title is None else title),
        panels=(
            *([_footfall(replay, worlds, time)] if replay.feet else []),
            _over_time(f"{height} (m)", replay, [(name, world.heights_m) for name, world in worlds], time),
            _over_time("Speed (m/s)", replay, [(name, world.speeds_m_s) for name, world in worlds], time),
        ),
        caption=_caption(replay, worlds),
        alt=f"{own}. {_description(replay, worlds)}",
        share_x=True,
        table=_table(replay, worlds),
        nothing="the physics failed",
    )


def _footfall(replay: Replay, worlds: Sequence[Named], time: Axis) -> Panel:
    """Return the panel of contacts: a row for each foot from the top, with the bars of each world side by side."""
    rows = len(replay.feet)
    marks: list[Mark] = []
    for place, (name, world) in enumerate(worlds):
        shift = 0.2 - 0.4 * place if len(worlds) > 1 else 0.0
        bars = [
            (begin, end, rows - 1 - foot + shift) for foot, spans in enumerate(world.contacts) for begin, end in spans
        ]
        marks.append(Bars(name, tuple(bars), style_of(place), 0.36))
    ticks = tuple((float(rows - 1 - foot), name) for foot, name in enumerate(replay.feet))
    return Panel(tuple(marks), time, Axis("On the ground", (-0.6, max(rows, 1) - 0.4), ticks=ticks), height=0.9)


def _over_time(label: str, replay: Replay, series: Sequence[tuple[str, Sequence[float]]], time: Axis) -> Panel:
    lines = [
        Line(name, replay.times_s, tuple(values), style_of(place), markers=False)
        for place, (name, values) in enumerate(series)
    ]
    marks: tuple[Mark, ...] = (*lines, *_counted(replay)) if lines else ()
    return Panel(marks, time, Axis(label, limits(each for _, values in series for each in values)))


def _counted(replay: Replay) -> tuple[Level, ...]:
    begin = replay.counted_s[0]
    return (Level("Fitness counts from here", begin, COUNTED, upright=True),) if 0 < begin < replay.times_s[-1] else ()


def _share(spans: Sequence[Interval], whole_s: float) -> float:
    return sum(end - begin for begin, end in spans) / whole_s if whole_s else 0.0


def _caption(replay: Replay, worlds: Sequence[Named]) -> str:
    reached = [f"{name.lower()} {number(world.fitness)} {replay.unit}" for name, world in worlds]
    parts = [f"Fitness {' and '.join(reached)}."] if reached else []
    return " ".join(
        [
            *parts,
            *(["Bars: the foot is less than 2 mm above the ground."] if replay.feet else []),
            "Speed: over ground in the direction of the whole motion, mean over 0.2 s.",
        ]
    )


def _description(replay: Replay, worlds: Sequence[Named]) -> str:
    parts = []
    for name, world in worlds:
        shares = [
            f"{foot} {100 * _share(spans, replay.times_s[-1]):.0f} %"
            for foot, spans in zip(replay.feet, world.contacts, strict=False)  # unknown without joint angles
        ]
        told = f"; share of the time on the ground: {', '.join(shares)}" if shares else ""
        parts.append(f"{name} its fitness is {number(world.fitness)} {replay.unit}{told}.")
    return " ".join(parts) or "The physics failed in both worlds."


def _height(replay: Replay) -> str:
    return f"Height of {replay.bodies[replay.observed].replace('_', ' ') if replay.observed else 'base'}"


def _table(replay: Replay, worlds: Sequence[Named]) -> Table:
    """Return the time share and number of contacts of each foot, and means of height and speed."""
    rows = [
        (
            f"{foot}: share of time on the ground, number of contacts",
            *(
                f"{100 * _share(world.contacts[at], replay.times_s[-1]):.0f} %, {len(world.contacts[at])} ×"
                if world.contacts
                else "unknown"
                for _, world in worlds
            ),
        )
        for at, foot in enumerate(replay.feet)
    ]
    means = [(f"Mean {_height(replay).lower()} (m)", [world.heights_m for _, world in worlds])]
    means.append(("Mean speed (m/s)", [world.speeds_m_s for _, world in worlds]))
    rows += [(label, *(number(sum(each) / len(each)) for each in values)) for label, values in means]
    rows.append((f"Fitness ({replay.unit})", *(number(world.fitness) for _, world in worlds)))
    return Table(("", *(name for name, _ in worlds)), tuple(rows))
