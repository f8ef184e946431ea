"""The readings of a robot's sensors during one rollout, in reality and in its simulator."""

from gaplab.schemas.replays import Replay, ReplayReadings
from gaplab.services.figures.marks import Axis, FigureDefinition, Line, Mark, Panel, Points, Table
from gaplab.services.figures.style import style_of
from gaplab.services.figures.words import heading, limits, number

SIMULATED, MEASURED = "In simulation", "In reality"

NO_SENSORS = Panel((), Axis("Time (s)", (0.0, 1.0)), Axis("", (0.0, 1.0)))


def readings_figure(replay: Replay, *, title: str | None = None) -> FigureDefinition:
    """Return a figure with a panel for each sensor: its readings in simulation, and those in reality.

    Args:
        replay: a motion; the figure is empty if its robot has no sensors.
        title: text above the figure; by default the controller.
    """
    whose = "sample" if replay.kind == "sample" else "transferred controller"
    own = f"The {whose} of iteration {replay.iteration}, repetition {replay.repetition}"
    found = replay.readings
    return FigureDefinition(
        name="readings",
        title=heading(own if title is None else title),
        panels=tuple(_panel(found, place) for place in range(len(found.sensors))) if found else (NO_SENSORS,),
        caption=_caption(found) if found else "",
        alt=f"{own}: readings of {', '.join(found.sensors)}." if found else own,
        share_x=True,
        table=_table(found) if found else Table((), ()),
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
    label = f"{found.sensors[place]} ({found.units[place]})"
    return Panel(tuple(marks), Axis("Time (s)", limits(found.times_s)), Axis(label, limits(values)))


def _caption(found: ReplayReadings) -> str:
    noises = (
        f"{name} {number(noise)} {unit}"
        for name, noise, unit in zip(found.sensors, found.noises, found.units, strict=True)
    )
    return f"Noise of the sensors, by which differences are divided: {', '.join(noises)}."


def _table(found: ReplayReadings) -> Table:
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
