"""What a controller does in one rollout, in reality and in its simulator: its gait, and the readings of its sensors."""

from collections.abc import Sequence

from gaplab.schemas.replays import Interval, Replay, ReplayReadings, ReplayWorld
from gaplab.services.figures.marks import Axis, Bars, FigureDefinition, Level, Line, Mark, Panel, Points, Table
from gaplab.services.figures.style import INK, Style, style_of
from gaplab.services.figures.words import heading, limits, number

COUNTED = Style(INK, "dotted", "circle")

SIMULATED, MEASURED = "In simulation", "In reality"

MOST_ROWS = 6
"""Most panels of sensors below each other; more are drawn two in a row."""

NO_SENSORS = Panel((), Axis("Time (s)", (0.0, 1.0)), Axis("", (0.0, 1.0)))

Named = tuple[str, ReplayWorld]


def gait_figure(replay: Replay, *, title: str | None = None) -> FigureDefinition:
    """Return a figure of footfalls, height and speed in simulation and in reality.

    A world whose physics failed is left out. The title is by default the controller.
    """
    there = [(SIMULATED, replay.simulation), (MEASURED, replay.reality)]
    worlds = [(name, world) for name, world in there if world is not None and world.heights_m]
    own = _controller(replay)
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


def _controller(replay: Replay) -> str:
    whose = "sample" if replay.kind == "sample" else "transferred controller"
    return f"The {whose} of iteration {replay.iteration}, repetition {replay.repetition}"


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


def readings_figure(replay: Replay, *, title: str | None = None) -> FigureDefinition:
    """Return a figure with a panel for each sensor: its readings in simulation, and those in reality.

    It is empty if the robot has no sensors. The title is by default the controller.
    """
    own, found = _controller(replay), replay.readings
    return FigureDefinition(
        name="readings",
        title=heading(own if title is None else title),
        panels=tuple(_panel(found, place) for place in range(len(found.sensors))) if found else (NO_SENSORS,),
        caption=_noises(found) if found else "",
        alt=f"{own}: readings of {', '.join(found.sensors)}." if found else own,
        share_x=True,
        columns=1 if found is None or len(found.sensors) <= MOST_ROWS else 2,
        table=_differences(found) if found else Table((), ()),
        nothing="the robot has no sensors",
    )


def _panel(found: ReplayReadings, place: int) -> Panel:
    """Return the panel of one sensor; its axis leaves room for the noise of what was measured."""
    noise, marks, values = found.noises[place], list[Mark](), list[float | None]()
    if found.simulation is not None:
        row = found.simulation[place]
        marks.append(Line(SIMULATED, found.times_s, row, style_of(0)))
        values += row
    if found.reality is not None:
        row = found.reality[place]
        marks.append(Points(MEASURED, found.times_s, row, style_of(1)))
        values += [value + side * noise for value in row if value is not None for side in (-1, 1)]
    name, unit = found.sensors[place], found.units[place]
    small = len(found.sensors) > MOST_ROWS
    y = Axis(unit if small else f"{name} ({unit})", limits(values))
    return Panel(tuple(marks), Axis("Time (s)", limits(found.times_s)), y, title=name if small else "")


def _noises(found: ReplayReadings) -> str:
    """Return the noise of each sensor; of those of one name for each joint, like `angle knee`, once."""
    named = zip(found.sensors, found.noises, found.units, strict=True)
    noises = dict.fromkeys(f"{name.partition(' ')[0]} {number(noise)} {unit}" for name, noise, unit in named)
    return f"Noise of the sensors, by which differences are divided: {', '.join(noises)}."


def _differences(found: ReplayReadings) -> Table:
    """Return the root mean square difference of each sensor, in its unit and in units of its noise."""
    rows = [
        (name, unit, number(away), number(None if away is None else away / noise))
        for name, unit, noise, away in zip(found.sensors, found.units, found.noises, _away(found), strict=True)
    ]
    return Table(("Sensor", "Unit", "Simulation from reality", "In units of noise"), tuple(rows))


def _away(found: ReplayReadings) -> list[float | None]:
    """Return the root mean square difference of each sensor between the two worlds; None if one is unknown."""
    if found.simulation is None or found.reality is None:
        return [None] * len(found.sensors)
    away = list[float | None]()
    for simulated, real in zip(found.simulation, found.reality, strict=True):
        squares = [(a - b) ** 2 for a, b in zip(simulated, real, strict=True) if a is not None and b is not None]
        away.append((sum(squares) / len(squares)) ** 0.5 if squares else None)
    return away
