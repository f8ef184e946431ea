"""One definition of each figure, for the page, notebooks and files.

A figure is a value (`marks.FigureDefinition`): panels with marks between axes, a caption, a description for screen
readers, and a table of its numbers. `style` has the looks of marks, `words` writes names and numbers. Two renderers
know nothing but marks: `plotly/` for the page, notebooks and HTML files, `matplotlib/` for SVG, PNG and PDF.

To add a figure, write one file in `kinds/`: a function from schemas or plain values to a `FigureDefinition`;
`squared_error` is a short example. For its address, add an endpoint `/figures/NAME` that returns
`answer(figure, query)` of `gaplab.api.http.figures`, as in `api/routes/figures.py`.
"""
