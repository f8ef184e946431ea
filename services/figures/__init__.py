"""One definition of each figure, drawn for the browser and for the file.

`definition` says what is in the figure of curves, `style` how its lines are told apart; `html` and `svg` draw it, and
decide nothing. Their libraries are imported when something is drawn.
"""
